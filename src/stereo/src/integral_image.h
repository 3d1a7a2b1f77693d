// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace planar_mapping::detail {

/// Differences of the sums of gray values of the right and the left, the lower and the upper half
/// of a square.
struct HaarWavelets {
  double x = 0.0;
  double y = 0.0;
};

/// Sums of gray values over rectangles; up to 8 million pixels.
class IntegralImage {
 public:
  explicit IntegralImage(const cv::Mat& gray) { cv::integral(gray, sums_, CV_32S); }

  int width() const { return sums_.cols - 1; }
  int height() const { return sums_.rows - 1; }
  /// Sums over all rows before this one, by column.
  const std::int32_t* before(int row) const { return sums_.ptr<std::int32_t>(row); }

  /// \param half  side of the square's halves, pixels; its middle is before the given pixel
  HaarWavelets haar(int column, int row, int half) const {
    const std::int32_t* top = before(row - half) + column;
    const std::int32_t* middle = before(row) + column;
    const std::int32_t* bottom = before(row + half) + column;
    const std::int32_t all = bottom[half] - bottom[-half] - top[half] + top[-half];
    const std::int32_t left = bottom[0] - bottom[-half] - top[0] + top[-half];
    const std::int32_t upper = middle[half] - middle[-half] - top[half] + top[-half];
    return {static_cast<double>(all - 2 * left), static_cast<double>(all - 2 * upper)};
  }

 private:
  cv::Mat sums_;
};

/// Sums over rectangles of the same rows at every step-th column.
class BoxRows {
 public:
  /// Of a rectangle that moves along the rows: at i it is about column i * step.
  struct Sum {
    const std::int32_t* before;
    const std::int32_t* end;
    std::int32_t operator()(int i) const { return end[i] - before[i]; }
  };

  /// Both ends included.
  void set(const IntegralImage& image, int first, int last, int step) {
    const std::int32_t* top = image.before(first);
    const std::int32_t* bottom = image.before(last + 1);
    step_ = step;
    stride_ = image.width() / step + 1;
    sums_.resize(static_cast<std::size_t>(stride_ * step));
    for (int phase = 0; phase < step; ++phase) {
      std::int32_t* out = &sums_[static_cast<std::size_t>(phase * stride_)];
      for (int i = phase; i <= image.width(); i += step) *out++ = bottom[i] - top[i];
    }
  }
  /// Columns from the middle, both ends included.
  Sum sum(int first, int last) const { return {at(first), at(last + 1)}; }

 private:
  const std::int32_t* at(int offset) const {
    const int phase = (offset % step_ + step_) % step_;
    return sums_.data() + phase * stride_ + (offset - phase) / step_;
  }

  int step_ = 1;
  int stride_ = 0;
  std::vector<std::int32_t> sums_;  ///< of the columns before one: all of phase 0, all of phase 1
};

}  // namespace planar_mapping::detail
