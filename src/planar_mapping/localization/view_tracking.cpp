// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/view_tracking.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kPerView = 150;    // features: what fixes a pose well, in a few milliseconds
constexpr int kPatch = 9;                // pixels a side, compared afterwards
constexpr double kMinCorrelation = 0.8;  // of the patches of one place
constexpr double kFlowReach = 8.0;       // pixels from where it should be
constexpr int kFlowIterations = 10;

/// Correlation of the gray values around two places.
double correlation(const cv::Mat& a, const cv::Point2f& in_a, const cv::Mat& b,
                   const cv::Point2f& in_b) {
  cv::Mat p, q;
  const cv::Size size(kPatch, kPatch);
  cv::getRectSubPix(a, size, in_a, p, CV_32F);
  cv::getRectSubPix(b, size, in_b, q, CV_32F);
  constexpr int kCount = kPatch * kPatch;
  Eigen::Map<Eigen::Array<float, kCount, 1>> x(p.ptr<float>());
  Eigen::Map<Eigen::Array<float, kCount, 1>> y(q.ptr<float>());
  x -= x.mean();
  y -= y.mean();
  const double squares = double{(x * x).sum()} * double{(y * y).sum()};
  return squares > 0.0 ? double{(x * y).sum()} / std::sqrt(squares) : 0.0;
}

}  // namespace

TrackedFeatures trackFeatures(const LocalMap& map, const View& now, const Pose& T_now_map) {
  TrackedFeatures tracked;
  tracked.expected.assign(map.size(), 0);
  for (std::size_t k = 0; k < map.size(); ++k) {
    const View& before = *map[k].view;
    const Pose T_now_view = T_now_map * map[k].T_map_view;
    std::vector<std::size_t> origins;
    std::vector<cv::Point2f> from, start;
    for (std::size_t i = 0; i < before.corners.size(); ++i) {
      FeatureSighting place;
      if (!isExpected(before, before.corners[i], now, T_now_view, place)) continue;
      origins.push_back(i);
      from.emplace_back(static_cast<float>(before.corners[i].seen.column),
                        static_cast<float>(before.corners[i].seen.row));
      start.emplace_back(static_cast<float>(place.column), static_cast<float>(place.row));
    }
    // Evenly of all, which are by their strength or by their place.
    const std::size_t step = (origins.size() + kPerView - 1) / kPerView;
    if (step > 1) {
      std::size_t kept = 0;
      for (std::size_t i = 0; i < origins.size(); i += step, ++kept) {
        origins[kept] = origins[i];
        from[kept] = from[i];
        start[kept] = start[i];
      }
      origins.resize(kept);
      from.resize(kept);
      start.resize(kept);
    }
    tracked.expected[k] = origins.size();
    if (origins.empty()) continue;
    std::vector<cv::Point2f> found = start;
    std::vector<std::uint8_t> status;
    cv::calcOpticalFlowPyrLK(
        before.pyramid, now.pyramid, from, found, status, cv::noArray(),
        cv::Size(kFlowWindow, kFlowWindow), kFlowLevels,
        cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kFlowIterations, 0.03),
        cv::OPTFLOW_USE_INITIAL_FLOW);
    std::vector<FeaturePair> pairs;
    for (std::size_t i = 0; i < origins.size(); ++i) {
      if (status[i] == 0 || cv::norm(found[i] - start[i]) > kFlowReach) continue;
      const FeatureSighting place{double{found[i].x}, double{found[i].y}, 0.0};
      if (!now.contains(place)) continue;
      const DepthThere there = depthAt(now, place.column, place.row);
      if (!(there.inverse_depth > 0.0)) continue;
      if (correlation(before.pyramid[0], from[i], now.pyramid[0], found[i]) < kMinCorrelation)
        continue;
      FeatureMatch match = mapSide(map[k], before.corners[origins[i]]);
      match.now = {place.column, place.row, there.inverse_depth};
      const double pixel = now.noise.pixel * now.noise.pixel;
      match.now_variance = {pixel, pixel, there.sigma * there.sigma};
      tracked.matches.push_back(match);
      tracked.views.push_back(k);
    }
  }
  return tracked;
}

}  // namespace planar_mapping::detail
