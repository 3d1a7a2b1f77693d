// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "planar_mapping/stereo/stereo_matcher.h"

namespace planar_mapping::detail {

struct SemiGlobalParams {
  int min_disparity = 0;
  int disparities = 64;
  SmoothnessPaths paths = SmoothnessPaths::Three;
  int block_size = 5;
  double smoothness_small = 8.0;
  double smoothness_large = 32.0;
  int prefilter_cap = 31;
  double uniqueness_percent = 5.0;
  double left_right_tolerance = 1.0;
  int speckle_size = 100;
  double speckle_range = 1.0;
  int threads = 1;
};

/// Disparities of the left image as floats, NaN = none; also of the columns that OpenCV leaves out
/// because the largest disparity would look beyond the border.
/// \param left, right  gray, of one size
cv::Mat matchSemiGlobally(const cv::Mat& left, const cv::Mat& right,
                          const SemiGlobalParams& params);

}  // namespace planar_mapping::detail
