// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace planar_mapping::detail {

/// Sums of gray values over rectangles. Sums of all pixels run over beyond 8 million; differences
/// of two are right modulo 2^32 all the same.
class IntegralImage {
 public:
  explicit IntegralImage(const cv::Mat& gray) { cv::integral(gray, sums_, CV_32S); }

  int width() const { return sums_.cols - 1; }
  int height() const { return sums_.rows - 1; }
  /// Sums over all rows before this one, by column.
  const std::int32_t* before(int row) const { return sums_.ptr<std::int32_t>(row); }

 private:
  cv::Mat sums_;
};

}  // namespace planar_mapping::detail
