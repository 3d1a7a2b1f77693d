// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace planar_mapping::detail {

/// Sums over rectangles of a raster, in constant time.
template <typename Sum>
class SummedArea {
 public:
  SummedArea() = default;
  /// \param values  of the cells, row by row
  template <typename Value>
  SummedArea(const std::vector<Value>& values, std::size_t width, std::size_t height,
             const Sum& zero)
      : pitch_(width + 1), sums_(pitch_ * (height + 1), zero) {
    for (std::size_t row = 0; row < height; ++row) {
      Sum in_row = zero;
      for (std::size_t column = 0; column < width; ++column) {
        in_row += values[row * width + column];
        sums_[(row + 1) * pitch_ + column + 1] = sums_[row * pitch_ + column + 1] + in_row;
      }
    }
  }

  bool empty() const { return sums_.empty(); }
  /// Of the columns [left, right) and rows [top, bottom).
  Sum over(std::size_t left, std::size_t top, std::size_t right, std::size_t bottom) const {
    return sums_[bottom * pitch_ + right] - sums_[bottom * pitch_ + left] -
           sums_[top * pitch_ + right] + sums_[top * pitch_ + left];
  }

 private:
  std::size_t pitch_ = 0;
  std::vector<Sum> sums_;  ///< of all above and left of each corner
};

}  // namespace planar_mapping::detail
