// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planes/tiles/organized_tiles.h"

namespace planar_mapping::detail {

/// A grid of cells, each the sums of its points, about the origin of the tiled cloud.
struct CellGrid {
  int columns = 0;
  int rows = 0;
  int capacity = 0;            ///< points of a full cell
  double* sums = nullptr;      ///< moment * cells + cell
  std::vector<double> memory;  ///< of the sums, unless they are somebody else's

  int cells() const { return columns * rows; }
  /// Uses \p room, which must hold kMoments * cells() values, or own memory if it is null.
  void allocate(double* room) {
    if (!room) memory.resize(static_cast<std::size_t>(kMoments) * cells());
    sums = room ? room : memory.data();
  }
  const double* moment(int m) const { return sums + static_cast<std::size_t>(m) * cells(); }
  double* moment(int m) { return sums + static_cast<std::size_t>(m) * cells(); }
  double count(int cell) const { return sums[cell]; }
};

CellGrid tileGrid(const TiledCloud& cloud, int threads);
CellGrid freeQuarterGrid(const TiledCloud& cloud, const std::vector<std::int16_t>& labels,
                         int threads);

/// Sums over the (2 radius + 1)^2 cells around each cell.
/// \param room for as many sums as \p grid has
CellGrid windowSums(const CellGrid& grid, int radius, double* room);

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
