// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <dlib/array2d.h>
#include <dlib/image_keypoint.h>

#include <algorithm>

#include "feature_detection.h"

namespace planar_mapping::detail {

DetectedFeatures detectSurf(const cv::Mat& gray, int count, double threshold) {
  constexpr int kOctaves = 3;
  constexpr int kIntervals = 4;
  constexpr int kStep = 2;  // pixels between samples of the first octave
  constexpr int kLength = 64;
  constexpr float kScale = 4096.0f;  // of descriptors of length 1
  constexpr int kSmallest = 64;      // pixels a side; the filters need room
  DetectedFeatures features;
  features.descriptors = Descriptors(false, kLength);
  if (gray.cols < kSmallest || gray.rows < kSmallest) return features;

  dlib::array2d<unsigned char> pixels(gray.rows, gray.cols);
  for (int row = 0; row < gray.rows; ++row)
    std::copy(gray.ptr(row), gray.ptr(row) + gray.cols, &pixels[row][0]);
  dlib::integral_image_generic<dlib::int32> integral;
  integral.load(pixels);
  dlib::hessian_pyramid pyramid;
  pyramid.build_pyramid(integral, kOctaves, kIntervals, kStep);
  std::vector<dlib::interest_point> points;
  dlib::get_interest_points(pyramid, threshold, points);

  std::vector<dlib::interest_point> usable;
  std::vector<Detection> detections;
  for (const dlib::interest_point& point : points) {
    const auto border = static_cast<unsigned long>(32.0 * point.scale);
    if (!dlib::get_rect(integral).contains(dlib::centered_rect(point.center, border, border)))
      continue;
    usable.push_back(point);
    detections.push_back({static_cast<float>(point.center.x()),
                          static_cast<float>(point.center.y()), static_cast<float>(point.score)});
  }
  dlib::matrix<double, 64, 1> descriptor;
  for (const std::size_t i : spreadEvenly(detections, gray.cols, gray.rows, count)) {
    const dlib::interest_point& point = usable[i];
    const double angle = dlib::compute_dominant_angle(integral, point.center, point.scale);
    dlib::compute_surf_descriptor(integral, point.center, point.scale, angle, descriptor);
    float values[kLength];
    for (int k = 0; k < kLength; ++k) values[k] = static_cast<float>(descriptor(k));
    features.places.push_back(detections[i]);
    features.descriptors.addValues(values, kScale);
  }
  return features;
}

}  // namespace planar_mapping::detail
