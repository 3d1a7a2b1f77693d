// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planes/tiles/organized_tiles.h"

namespace planar_mapping::detail {

/// A grid of cells, each the sums of its points, about the origin of the tiled cloud.
struct CellGrid {
  int columns;
  int rows;
  int capacity;              ///< points of a full cell
  std::vector<double> sums;  ///< moment * cells + cell

  CellGrid(int columns_, int rows_, int capacity_)
      : columns(columns_),
        rows(rows_),
        capacity(capacity_),
        sums(static_cast<std::size_t>(kMoments) * cells(), 0.0) {}
  int cells() const { return columns * rows; }
  const double* moment(int m) const { return sums.data() + static_cast<std::size_t>(m) * cells(); }
  double* moment(int m) { return sums.data() + static_cast<std::size_t>(m) * cells(); }
  double count(int cell) const { return sums[static_cast<std::size_t>(cell)]; }
  void set(std::size_t cell, const MomentSums& to) {
    for (int m = 0; m < kMoments; ++m) moment(m)[cell] = to[static_cast<std::size_t>(m)];
  }
};

CellGrid tileGrid(const TiledCloud& cloud, int threads);
CellGrid freeQuarterGrid(const TiledCloud& cloud, const std::vector<std::int16_t>& labels,
                         int threads);

/// Sums over the (2 radius + 1)^2 cells around each cell.
CellGrid windowSums(const CellGrid& grid, int radius);

/// Sums over the (2 radius + 1)^2 cells around one cell.
MomentSums sumWindow(const CellGrid& grid, int cell, int radius);

inline void addSums(MomentSums& sums, const MomentSums& other) {
  for (std::size_t m = 0; m < kMoments; ++m) sums[m] += other[m];
}
inline MomentSums sumsOf(const CellGrid& grid, int cell) {
  MomentSums sums;
  for (int m = 0; m < kMoments; ++m) sums[static_cast<std::size_t>(m)] = grid.moment(m)[cell];
  return sums;
}
inline Vector3 meanOf(const MomentSums& sums) {
  return Vector3(sums[kX], sums[kY], sums[kZ]) / sums[kN];
}
inline Vector3 meanOf(const CellGrid& grid, int cell) {
  return Vector3(grid.moment(kX)[cell], grid.moment(kY)[cell], grid.moment(kZ)[cell]) /
         grid.count(cell);
}

}  // namespace planar_mapping::detail
