// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "features/feature_detection.h"

#include <algorithm>
#include <numeric>
#include <opencv2/features2d.hpp>

namespace planar_mapping::detail {
namespace {

std::vector<Detection> detectionsOf(const std::vector<cv::KeyPoint>& points) {
  std::vector<Detection> detections;
  detections.reserve(points.size());
  for (const cv::KeyPoint& point : points)
    detections.push_back({point.pt.x, point.pt.y, point.response});
  return detections;
}

/// Detects, chooses evenly, and describes what was chosen.
DetectedFeatures runDetector(cv::Feature2D& detector, const cv::Mat& gray, int count) {
  std::vector<cv::KeyPoint> points;
  detector.detect(gray, points);
  const std::vector<Detection> all = detectionsOf(points);
  std::vector<cv::KeyPoint> chosen;
  for (const std::size_t i : spreadEvenly(all, gray.cols, gray.rows, count))
    chosen.push_back(points[i]);
  cv::Mat rows;
  if (!chosen.empty()) detector.compute(gray, chosen, rows);

  DetectedFeatures features;
  features.places = detectionsOf(chosen);
  const bool binary = rows.type() == CV_8U;
  const auto columns = static_cast<std::size_t>(rows.cols);
  features.descriptors = Descriptors(binary, binary ? (columns + 7) / 8 : columns);
  for (int row = 0; row < rows.rows; ++row) {
    if (binary) {
      features.descriptors.addBytes(rows.ptr(row), columns);
    } else {
      features.descriptors.addValues(rows.ptr<float>(row), 1.0f);  // SIFT has whole numbers
    }
  }
  return features;
}

}  // namespace

std::vector<std::size_t> spreadEvenly(const std::vector<Detection>& detections, int width,
                                      int height, int count) {
  std::vector<std::size_t> order(detections.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto wanted = static_cast<std::size_t>(count);
  if (detections.size() <= wanted) return order;
  const auto stronger = [&](std::size_t a, std::size_t b) {
    const Detection& first = detections[a];
    const Detection& second = detections[b];
    if (first.response != second.response) return first.response > second.response;
    return a < b;
  };
  std::sort(order.begin(), order.end(), stronger);
  constexpr int kColumns = 8;
  constexpr int kRows = 6;
  const std::size_t quota = (wanted + kColumns * kRows - 1) / (kColumns * kRows);
  std::vector<std::size_t> taken_in_cell(kColumns * kRows, 0);
  std::vector<std::size_t> chosen;
  std::vector<std::size_t> rest;
  for (const std::size_t i : order) {
    const auto cellOf = [](float place, int side, int cells) {
      return std::clamp(
          static_cast<int>(place * static_cast<float>(cells) / static_cast<float>(side)), 0,
          cells - 1);
    };
    const int cell = cellOf(detections[i].row, height, kRows) * kColumns +
                     cellOf(detections[i].column, width, kColumns);
    std::size_t& taken = taken_in_cell[static_cast<std::size_t>(cell)];
    if (taken < quota && chosen.size() < wanted) {
      ++taken;
      chosen.push_back(i);
    } else {
      rest.push_back(i);
    }
  }
  const std::size_t missing = std::min(wanted - chosen.size(), rest.size());
  chosen.insert(chosen.end(), rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(missing));
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

DetectedFeatures detectFeatures(const cv::Mat& gray, const FeatureTrackerParams& params,
                                int count) {
  const double threshold = params.detection_threshold;
  // More candidates than wanted, so that there is a choice.
  const int candidates = 3 * count;
  switch (params.detector) {
    case FeatureDetector::Automatic:
    case FeatureDetector::Surf:
      return detectSurf(gray, count, threshold > 0.0 ? threshold : 10.0);
    case FeatureDetector::Orb: {
      constexpr float kPyramidFactor = 1.2f;
      const auto orb =
          cv::ORB::create(candidates, kPyramidFactor, 8, 31, 0, 2, cv::ORB::HARRIS_SCORE, 31,
                          threshold > 0.0 ? static_cast<int>(threshold) : 12);
      return runDetector(*orb, gray, count);
    }
    case FeatureDetector::Akaze: {
      const auto akaze = cv::AKAZE::create(cv::AKAZE::DESCRIPTOR_MLDB, 0, 3,
                                           threshold > 0.0 ? static_cast<float>(threshold) : 5e-4f);
      return runDetector(*akaze, gray, count);
    }
    case FeatureDetector::Sift:
      break;
  }
  const auto sift = cv::SIFT::create(0, 3, threshold > 0.0 ? threshold : 0.03);
  return runDetector(*sift, gray, count);
}

}  // namespace planar_mapping::detail
