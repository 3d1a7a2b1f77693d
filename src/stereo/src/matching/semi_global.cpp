// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "matching/semi_global.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "matching/three_paths.h"

namespace planar_mapping::detail {
namespace {

constexpr int kFixedPoint = 16;  // of OpenCV's disparities

/// In units of 1 / 16 pixel; (min_disparity - 1) * 16 = none.
cv::Mat matchWithOpenCv(const cv::Mat& left, const cv::Mat& right, const SemiGlobalParams& params) {
  const int disparities = (params.disparities + 15) / 16 * 16;  // OpenCV wants whole sixteens
  const int beyond = params.min_disparity + disparities;
  const int pad_left = std::max(beyond, 0);
  const int pad_right = std::max(-params.min_disparity, 0);
  cv::Mat wide_left;
  cv::Mat wide_right;
  cv::copyMakeBorder(left, wide_left, 0, 0, pad_left, pad_right, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(right, wide_right, 0, 0, pad_left, pad_right, cv::BORDER_REPLICATE);

  const int area = params.block_size * params.block_size;
  const auto penalty = [area](double value) { return static_cast<int>(std::lround(value * area)); };
  const int tolerance =
      params.left_right_tolerance < 0.0
          ? -1
          : std::max(1, static_cast<int>(std::lround(params.left_right_tolerance)));
  const int small = penalty(params.smoothness_small);
  const cv::Ptr<cv::StereoSGBM> matcher = cv::StereoSGBM::create(
      params.min_disparity, disparities, params.block_size, small,
      std::max(penalty(params.smoothness_large), small + 1), tolerance, params.prefilter_cap,
      static_cast<int>(std::lround(params.uniqueness_percent)), 0, 0,
      params.paths == SmoothnessPaths::Five ? cv::StereoSGBM::MODE_SGBM : cv::StereoSGBM::MODE_HH);
  cv::Mat fixed;
  matcher->compute(wide_left, wide_right, fixed);
  return fixed.colRange(pad_left, pad_left + left.cols).clone();
}

}  // namespace

cv::Mat matchSemiGlobally(const cv::Mat& left, const cv::Mat& right,
                          const SemiGlobalParams& params) {
  cv::Mat fixed = params.paths == SmoothnessPaths::Three ? matchAlongThreePaths(left, right, params)
                                                         : matchWithOpenCv(left, right, params);
  const int none = (params.min_disparity - 1) * kFixedPoint;
  for (int row = 0; row < fixed.rows; ++row) {
    auto* values = fixed.ptr<std::int16_t>(row);
    for (int column = 0; column < fixed.cols; ++column) {
      const int in_right = column * kFixedPoint - values[column];
      if (in_right < 0 || in_right > (left.cols - 1) * kFixedPoint)
        values[column] = static_cast<std::int16_t>(none);
    }
  }
  if (params.speckle_size > 0) {
    cv::filterSpeckles(fixed, none, params.speckle_size, params.speckle_range * kFixedPoint);
  }
  cv::Mat disparity(fixed.size(), CV_32F);
  for (int row = 0; row < fixed.rows; ++row) {
    const auto* values = fixed.ptr<std::int16_t>(row);
    float* out = disparity.ptr<float>(row);
    for (int column = 0; column < fixed.cols; ++column) {
      out[column] = values[column] <= none ? std::numeric_limits<float>::quiet_NaN()
                                           : static_cast<float>(values[column]) / kFixedPoint;
    }
  }
  return disparity;
}

}  // namespace planar_mapping::detail
