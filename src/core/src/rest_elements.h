// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "planar_mapping/core/compact_cover.h"

namespace planar_mapping::detail {

using HalfCell = std::array<std::int64_t, 3>;  ///< x, y, z, each within 2^32 of 0

/// \return false beyond all half cells, or if the point is not finite
bool halfCellOf(const Vector3& point, double half, HalfCell& cell);

/// What a half cell holds.
class Element {
 public:
  Element(const HalfCell& at, float belief, bool is_required, bool is_exact)
      : probability(belief), required(is_required), exact(is_exact) {
    std::uint64_t c[3];
    for (std::size_t k = 0; k < 3; ++k) c[k] = static_cast<std::uint64_t>(at[k] + kFarthest);
    rank_[0] = (c[2] >> 3 << kBlockBits) | c[1] >> 3;
    rank_[1] = (c[0] >> 3 << 9) | (c[2] & 7) << 6 | (c[1] & 7) << 3 | (c[0] & 7);
  }
  HalfCell at() const {
    constexpr std::uint64_t kBlock = (std::uint64_t{1} << kBlockBits) - 1;
    return {position(rank_[1] >> 9, rank_[1] & 7), position(rank_[0] & kBlock, rank_[1] >> 3 & 7),
            position(rank_[0] >> kBlockBits, rank_[1] >> 6 & 7)};
  }
  bool isAt(const Element& o) const {  // in the same half cell
    return rank_[0] == o.rank_[0] && rank_[1] == o.rank_[1];
  }
  /// Block by block of 8 x 8 x 8; of those of one half cell the one that is to stay is the first.
  bool operator<(const Element& o) const {
    if (rank_[0] != o.rank_[0]) return rank_[0] < o.rank_[0];
    if (rank_[1] != o.rank_[1]) return rank_[1] < o.rank_[1];
    if (required != o.required) return required;
    if (exact != o.exact) return exact;
    return probability > o.probability;
  }

  float probability;
  bool required;
  bool exact;  ///< holds points anywhere in it, not those of a surface alone

 private:
  static constexpr std::int64_t kFarthest = std::int64_t{1} << 32;
  static constexpr int kBlockBits = 30;  ///< of 33 an axis, the last three are those in a block
  static std::int64_t position(std::uint64_t block, std::uint64_t in_block) {
    return static_cast<std::int64_t>(block << 3 | in_block) - kFarthest;
  }

  std::uint64_t rank_[2];  ///< blocks of z and y; block of x, then z, y, x within the block
};

void addElements(const std::vector<SurfacePiece>& pieces, double half,
                 std::vector<Element>& elements);

/// Those of cells with enough points, and where boxes may lie because a cell needs none.
void addElements(const std::vector<NonPlanarCell>& cells, bool tolerant, int min_points,
                 std::vector<Element>& elements);

/// Leaves one of each half cell.
void sortElements(std::vector<Element>& elements);

}  // namespace planar_mapping::detail
