// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/geometry/point_sums.h"
#include "planar_mapping/planes/plane_search.h"

namespace planar_mapping::detail {

namespace {

/// Near the middle of the inliers, so that sums of squares keep their digits.
Vector3 roughMiddle(const PointsView& points, const Indices& inliers) {
  Vector3 sum = Vector3::Zero();
  const std::size_t step = 1 + inliers.size() / 64;
  double n = 0.0;
  for (std::size_t i = 0; i < inliers.size(); i += step, n += 1.0) {
    sum += points.point(static_cast<std::size_t>(inliers[i]));
  }
  return sum / std::max(n, 1.0);
}

void addTo(PointSums& sums, const Vector3& origin, const float* p, double weight) {
  sums.add(p[0] - origin[0], p[1] - origin[1], p[2] - origin[2], weight);
}

/// Removes the inliers beyond the band of \p plane, also from \p sums. \return how many
std::size_t letGo(const PointsView& points, const Plane& plane, const DistanceBand& band,
                  const Vector3& origin, Indices& inliers, PointSums& sums) {
  const double a = plane.normal[0], b = plane.normal[1], c = plane.normal[2];
  std::size_t kept = 0;
  for (const int index : inliers) {
    const float* p = points[static_cast<std::size_t>(index)];
    const double distance = std::abs(a * p[0] + b * p[1] + c * p[2] + plane.offset);
    if (distance <= band.at(p[2])) {
      inliers[kept++] = index;
    } else {
      addTo(sums, origin, p, -1.0);
    }
  }
  const std::size_t removed = inliers.size() - kept;
  inliers.resize(kept);
  return removed;
}

/// Least squares over the inliers and all that is said about the result.
/// \return false if they span no plane or are too few
bool describe(const PointsView& points, const MultiPlaneParams& params, const Vector3& sensor,
              InlierRule rule, PlaneSegment& segment) {
  const auto too_few = [&] {
    return segment.inliers.size() < static_cast<std::size_t>(params.min_inliers);
  };
  if (too_few()) return false;
  const Vector3 origin = roughMiddle(points, segment.inliers);
  PointSums sums;
  for (const int index : segment.inliers) {
    addTo(sums, origin, points[static_cast<std::size_t>(index)], 1.0);
  }
  segment.moments = sums.moments(origin);
  PlaneMoments::Fit fit = segment.moments.fit();
  if (!fit.valid) return false;
  if (rule == InlierRule::WithinThreshold) {
    // A point let go moves the plane a little, so once more until nothing changes; the last round
    // keeps the plane its inliers were found by.
    constexpr int kRounds = 8;
    const DistanceBand band(params);
    for (int round = 1; letGo(points, fit.plane, band, origin, segment.inliers, sums) > 0;
         ++round) {
      if (too_few()) return false;
      segment.moments = sums.moments(origin);
      if (round == kRounds) break;
      fit = segment.moments.fit();
      if (!fit.valid) return false;
    }
  }
  segment.plane = orientedTowards(fit.plane, sensor);
  segment.rms = fit.rms;
  segment.tilt = normalizedTilt(segment.plane);
  segment.covariance = segment.moments.planeCovariance(fit);
  const double gap = params.patch_gap > 0.0 ? params.patch_gap
                                            : automaticPatchGap(fit, segment.moments.weight(),
                                                                params.distance_threshold);
  findPatches(points, gap, segment);
  return true;
}

}  // namespace

PlaneSet assemblePlaneSet(const PointsView& points, const std::vector<std::int32_t>& labels,
                          const std::vector<Plane>& planes, const MultiPlaneParams& params,
                          const Vector3& sensor, InlierRule rule) {
  PlaneSet set;
  const std::size_t number = planes.size();
  std::vector<std::size_t> count(number, 0);
  for (const std::int32_t label : labels) {
    if (label >= 0) ++count[static_cast<std::size_t>(label)];
  }
  std::vector<PlaneSegment> segments(number);
  for (std::size_t k = 0; k < number; ++k) {
    segments[k].plane = planes[k];
    segments[k].inliers.reserve(count[k]);
  }
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] >= 0) {
      segments[static_cast<std::size_t>(labels[i])].inliers.push_back(static_cast<int>(i));
    }
  }
  std::vector<char> good(number, 0);
  parallelFor(number, params.threads, [&](std::size_t k) {
    good[k] = describe(points, params, sensor, rule, segments[k]) ? 1 : 0;
  });
  for (std::size_t k = 0; k < number; ++k) {
    if (good[k] != 0) {
      set.planes.push_back(std::move(segments[k]));
    } else {
      ++set.diagnostics.rejected_too_small;
    }
  }
  sortBySize(set.planes);
  return set;
}

void sortBySize(std::vector<PlaneSegment>& planes) {
  std::sort(planes.begin(), planes.end(), [](const PlaneSegment& a, const PlaneSegment& b) {
    if (a.inliers.size() != b.inliers.size()) return a.inliers.size() > b.inliers.size();
    return a.inliers.front() < b.inliers.front();
  });
}

}  // namespace planar_mapping::detail
