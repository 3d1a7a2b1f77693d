// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "matching/disparity_range.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "matching/semi_global.h"

#include <opencv2/imgproc.hpp>

namespace planar_mapping::detail {
namespace {

/// Smaller by a power of two until a search over all disparities takes about 2 ms.
int reductionFor(const cv::Mat& image) {
  constexpr std::size_t kPixels = 30000;
  int factor = 1;
  while (image.total() / static_cast<std::size_t>(factor * factor) > kPixels &&
         std::min(image.cols, image.rows) / (2 * factor) >= 24) {
    factor *= 2;
  }
  return factor;
}

/// By mean and spread of the pixels that \p disparity says are the same.
Exposure exposureOfMatches(const cv::Mat& left, const cv::Mat& right, const cv::Mat& disparity) {
  std::vector<std::uint8_t> in_left;
  std::vector<std::uint8_t> in_right;
  for (int row = 0; row < disparity.rows; ++row) {
    for (int column = 0; column < disparity.cols; ++column) {
      const float value = disparity.ptr<float>(row)[column];
      const int other = std::isnan(value) ? -1 : column - static_cast<int>(std::lround(value));
      if (other < 0 || other >= right.cols) continue;
      in_left.push_back(left.ptr(row)[column]);
      in_right.push_back(right.ptr(row)[other]);
    }
  }
  Exposure exposure;
  if (in_left.empty()) return exposure;
  cv::Scalar mean_left, spread_left, mean, spread;
  cv::meanStdDev(in_left, mean_left, spread_left);
  cv::meanStdDev(in_right, mean, spread);
  if (!(spread_left[0] > 0.0) || !(spread[0] > 0.0)) return exposure;
  exposure.gain = spread_left[0] / spread[0];
  exposure.offset = mean_left[0] - exposure.gain * mean[0];
  exposure.change = std::abs(mean_left[0] - mean[0]) + std::abs(spread_left[0] - spread[0]);
  return exposure;
}

}  // namespace

CoarseDisparities searchCoarsely(const cv::Mat& left, const cv::Mat& right, double infinity,
                                 double largest) {
  const int factor = reductionFor(left);
  const cv::Size size(left.cols / factor, left.rows / factor);
  cv::Mat small_left;
  cv::Mat small_right;
  cv::resize(left, small_left, size, 0.0, 0.0, cv::INTER_AREA);
  cv::resize(right, small_right, size, 0.0, 0.0, cv::INTER_AREA);
  const double scale = static_cast<double>(left.cols) / size.width;

  DisparityRange range;
  range.low = static_cast<int>(std::floor(infinity / scale));
  range.count = static_cast<int>(std::ceil(largest / scale)) - range.low + 1;
  StereoMatcherParams params;
  params.block_size = 3;
  params.uniqueness_percent = 10;
  params.left_right_tolerance = 1;
  params.speckle_size = 20;
  params.speckle_range = 2.0;
  const cv::Mat disparity = matchSemiGlobally(small_left, small_right, range, params);

  cv::Mat contrast;  // along rows
  cv::absdiff(small_left.colRange(1, size.width), small_left.colRange(0, size.width - 1), contrast);
  const double plain = cv::mean(contrast)[0];
  std::vector<float> found;
  found.reserve(disparity.total());
  std::size_t textured = 0;
  std::size_t matched = 0;
  for (int row = 0; row < disparity.rows; ++row) {
    const float* values = disparity.ptr<float>(row);
    const std::uint8_t* steps = contrast.ptr(row);
    for (int column = 0; column < disparity.cols; ++column) {
      const bool is_found = !std::isnan(values[column]);
      if (is_found) found.push_back(values[column]);
      if (column + 1 == disparity.cols || steps[column] < plain) continue;
      ++textured;
      matched += is_found ? 1 : 0;
    }
  }
  CoarseDisparities coarse;
  if (found.empty()) return coarse;
  coarse.exposure = exposureOfMatches(small_left, small_right, disparity);
  coarse.density =
      static_cast<double>(matched) / static_cast<double>(std::max<std::size_t>(1, textured));
  // So few pixels at either end are more likely wrong than seen.
  const std::size_t outliers = found.size() / 400;
  const auto low = found.begin() + static_cast<std::ptrdiff_t>(outliers);
  std::nth_element(found.begin(), low, found.end());
  coarse.low = *low * scale;
  const auto high = found.end() - 1 - static_cast<std::ptrdiff_t>(outliers);
  std::nth_element(found.begin(), high, found.end());
  coarse.high = *high * scale;
  return coarse;
}

}  // namespace planar_mapping::detail
