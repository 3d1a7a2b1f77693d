// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "planar_mapping/stereo/matching/stereo_matcher.h"

namespace planar_mapping::detail {

/// Whole disparities that are looked at, pixels.
struct DisparityRange {
  int low = 0;
  int count = 0;
};

/// Disparities of the left image as floats, NaN = none; also of the columns that OpenCV leaves out
/// because the largest disparity would look beyond the border.
/// \param left, right  gray, of one size
/// \param params       what is looked at is said by \p range
cv::Mat matchSemiGlobally(const cv::Mat& left, const cv::Mat& right, const DisparityRange& range,
                          const StereoMatcherParams& params);

}  // namespace planar_mapping::detail
