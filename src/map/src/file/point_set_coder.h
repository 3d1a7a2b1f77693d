// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "file/bit_coder.h"
#include "store/key_map.h"

namespace planar_mapping::detail {

/// Codes a few points of a large lattice, in no order (docs/finished_map.md, "Point sets"): a box
/// around them is halved again and again, and each time coded how many lie in the lower half.
class PointSetCoder {
 public:
  /// Coordinates are within +-kLimit.
  static constexpr std::int32_t kLimit = 1 << 22;

  /// \param points as many as there are, several may be the same; any order when writing, sorted by
  ///               (z, y, x) afterwards. In a plane all z are 0. \throws Error
  void code(BitCoder& coder, std::vector<Int3>& points);
  void forget();

 private:
  static constexpr std::size_t kMostKinds = 16;

  /// Lower corner and size.
  struct Box {
    std::array<std::int32_t, 3> low{};
    std::array<std::int32_t, 3> size{};
  };
  void halve(BitCoder& coder, Int3* points, std::size_t n, const Box& box);
  std::size_t codeLower(BitCoder& coder, std::size_t lower, std::size_t n);

  std::array<NumberModel, 3> low_, size_;
  AdaptiveBit single_;
  std::array<AdaptiveBit, kMostKinds> together_;  ///< by the number of points
  AdaptiveBit side_;
  std::array<AdaptiveBit, kMostKinds> bisected_;  ///< by the step
};

}  // namespace planar_mapping::detail
