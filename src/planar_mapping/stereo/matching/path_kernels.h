// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace planar_mapping::detail {

// The loops over disparities of matchAlongThreePaths(). Rows of disparities are whole blocks of
// kPathLanes; a path has room for one more before and behind them.

using Byte = std::uint8_t;
using Word = std::uint16_t;

constexpr int kPathLanes = 32;
constexpr Byte kNever = 200;         // cost beyond both ends of the range
constexpr int kDisparityScale = 16;  // of a pixel, as OpenCV's disparities

struct RowView {
  const Byte *value, *low, *high;
};

struct Penalties {
  Byte small, large;
};

struct Choice {
  std::int16_t disparity = -1;  ///< -1 = none
  std::int16_t fraction = 0;    ///< of a pixel, in units of 1 / 16
};

/// Horizontal gradients of a row, cut off at \p cap and moved up by it.
void filterRow(const Byte* above, const Byte* own, const Byte* below, int width, int cap,
               Byte* out);
/// Smallest and largest value within half a pixel. \pre two columns at least
void boundRow(const Byte* value, int width, Byte* low, Byte* high);
/// Costs of a row of pixels go into the sums over the rows of a window, and those of the row that
/// leaves it out of them. The right row is reversed, so that disparities ascend along it.
void addCosts(RowView l_slope, RowView l_gray, RowView r_slope, RowView r_gray, int width,
              int count, Byte largest, Byte* ring, Word* sums);
/// Costs of windows, and the paths from the left and from above, added up.
/// \param above, above_least  of the row above; replaced by those of this one
void passForward(const Word* sums, int width, int count, int half, int shift, Penalties p,
                 Word* window, Byte* left, Byte* costs, const Byte* above, Byte* fresh_above,
                 Byte* above_least, Word* total);
/// The path from the right is added; the best disparity of each pixel.
void passBackward(const Byte* costs, int width, int count, Penalties p, std::uint64_t rival_factor,
                  Byte* left, Word* total, Choice* out);
/// The best disparity of each pixel of the right image, reversed.
void lookFromRight(const Word* total, int width, int count, Word* costs, Word* disparities);

}  // namespace planar_mapping::detail
