// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "features/descriptors.h"
#include "planar_mapping/stereo/feature_tracker.h"

namespace planar_mapping::detail {

struct Detection {
  float column = 0.0f;
  float row = 0.0f;
  float response = 0.0f;
};

struct DetectedFeatures {
  std::vector<Detection> places;
  Descriptors descriptors;

  std::size_t size() const { return places.size(); }
};

/// \param gray   8 bits, without padding
/// \param count  at most
DetectedFeatures detectFeatures(const cv::Mat& gray, const FeatureTrackerParams& params, int count);

/// Positions of up to `count` detections: the strongest of each cell of a grid over the image
/// first, then the strongest of the rest. Ascending.
std::vector<std::size_t> spreadEvenly(const std::vector<Detection>& detections, int width,
                                      int height, int count);

/// SURF. \param threshold  of the determinant of the Hessian
DetectedFeatures detectSurf(const cv::Mat& gray, int count, double threshold);

}  // namespace planar_mapping::detail
