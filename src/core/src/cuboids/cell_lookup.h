// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "grid/cell_numbering.h"

namespace planar_mapping::detail {

/// Position of cells in a list: a dense array where the list fills its bounding box well enough,
/// else a hash table.
class CellLookup {
 public:
  /// \param cells distinct
  explicit CellLookup(const std::vector<CellKey>& cells);

  /// -1 if the cell is not in the list.
  std::int32_t at(std::int32_t x, std::int32_t y, std::int32_t z) const {
    if (dense_.empty()) return sparse_.at({x, y, z});
    // Unsigned differences: what lies below the low corner becomes too large.
    const std::uint32_t dx = static_cast<std::uint32_t>(x) - static_cast<std::uint32_t>(low_[0]);
    const std::uint32_t dy = static_cast<std::uint32_t>(y) - static_cast<std::uint32_t>(low_[1]);
    const std::uint32_t dz = static_cast<std::uint32_t>(z) - static_cast<std::uint32_t>(low_[2]);
    if (dx >= size_[0] || dy >= size_[1] || dz >= size_[2]) return -1;
    return dense_[(static_cast<std::size_t>(dz) * size_[1] + dy) * size_[0] + dx];
  }
  /// The cell \p dx, dy, dz away; false at the end of the number range.
  std::int32_t neighbour(const CellKey& cell, int dx, int dy, int dz) const {
    CellKey other = cell;
    if (!step(other, 0, dx) || !step(other, 1, dy) || !step(other, 2, dz)) return -1;
    return at(other[0], other[1], other[2]);
  }

 private:
  CellKey low_{};
  std::array<std::uint32_t, 3> size_{};
  std::vector<std::int32_t> dense_;
  CellNumbering sparse_;
};

/// Connected components of the cells (across faces, edges and corners).
/// \return component per cell, numbered by first cell
std::vector<std::int32_t> connectedComponents(const std::vector<CellKey>& cells,
                                              const CellLookup& lookup);

}  // namespace planar_mapping::detail
