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

/// Sums of gray values over rectangles. Sums of all pixels run over beyond 8 million; differences
/// of two are right modulo 2^32 all the same.
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
    const std::int32_t all = area(top, bottom, -half, half);
    const std::int32_t left = area(top, bottom, -half, 0);
    const std::int32_t upper = area(top, middle, -half, half);
    return {static_cast<double>(all - 2 * left), static_cast<double>(all - 2 * upper)};
  }

 private:
  static std::int32_t area(const std::int32_t* top, const std::int32_t* bottom, int from, int to) {
    const auto of = [](std::int32_t sum) { return static_cast<std::uint32_t>(sum); };
    return static_cast<std::int32_t>(of(bottom[to]) - of(bottom[from]) - of(top[to]) +
                                     of(top[from]));
  }

  cv::Mat sums_;
};

/// The same sums for rectangles about every step-th column: of columns 0, step, 2 step, ..., then
/// of 1, step + 1, ..., so that neighbouring rectangles read neighbouring numbers.
class SteppedSums {
 public:
  SteppedSums(const IntegralImage& image, int step)
      : step_(step), stride_(image.width() / step + 1) {
    sums_.resize(at(image.height() + 1));
    for (int row = 0; row <= image.height(); ++row) {
      const std::int32_t* in = image.before(row);
      for (int phase = 0; phase < step; ++phase) {
        std::int32_t* out = sums_.data() + at(row) + phase * stride_;
        for (int column = phase; column <= image.width(); column += step) *out++ = in[column];
      }
    }
  }

  int rowLength() const { return step_ * stride_; }
  const std::int32_t* before(int row) const { return sums_.data() + at(row); }
  /// Of a column relative to the rectangles' middle, in a row.
  int placeOf(int offset) const {
    const int phase = (offset % step_ + step_) % step_;
    return phase * stride_ + (offset - phase) / step_;
  }

 private:
  std::size_t at(int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(rowLength());
  }

  int step_;
  int stride_;
  std::vector<std::int32_t> sums_;
};

/// Sums over rectangles of the same rows.
class BoxRows {
 public:
  /// Of a rectangle that moves along the rows: at i it is about column i * step.
  struct Sum {
    const std::int32_t* row;
    int before, end;  ///< places in the row; the first may be negative where i is not
    std::int32_t operator()(int i) const {
      return static_cast<std::int32_t>(static_cast<std::uint32_t>(row[end + i]) -
                                       static_cast<std::uint32_t>(row[before + i]));
    }
  };

  explicit BoxRows(const SteppedSums& image)
      : image_(image), sums_(static_cast<std::size_t>(image.rowLength())) {}

  /// Both ends included.
  void set(int first, int last) {
    const std::int32_t* top = image_.before(first);
    const std::int32_t* bottom = image_.before(last + 1);
    for (std::size_t i = 0; i < sums_.size(); ++i)
      sums_[i] = static_cast<std::int32_t>(static_cast<std::uint32_t>(bottom[i]) -
                                           static_cast<std::uint32_t>(top[i]));
  }
  /// Columns from the middle, both ends included.
  Sum sum(int first, int last) const {
    return {sums_.data(), image_.placeOf(first), image_.placeOf(last + 1)};
  }

 private:
  const SteppedSums& image_;
  std::vector<std::int32_t> sums_;
};

}  // namespace planar_mapping::detail
