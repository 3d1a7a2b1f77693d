// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "planar_mapping/map/store/key_map.h"

namespace planar_mapping::detail {

/// Cell of a point that is not finite or lies beyond the lattice.
constexpr std::int32_t kOutside = -kLatticeLimit - 1;
/// Points handled at once by the loops below.
constexpr std::size_t kBatch = 512;

/// u = m0 x + m1 y + m2 z + m3 and v = m4 x + ... of \p n <= kBatch points of a strided cloud, in
/// cells; both kOutside where one leaves the lattice.
void planeCoordinates(const float* data, std::size_t stride, const int* indices, std::size_t n,
                      const double* m, double* u, double* v);

/// Which cells there are: what lies beyond belongs to the cells at the rim.
struct CellWindow {
  std::int32_t low_a = -kLatticeLimit;
  std::int32_t low_b = -kLatticeLimit;
  std::int32_t high_a = kLatticeLimit - 1;
  std::int32_t high_b = kLatticeLimit - 1;
};

/// Cells of points in a row. Neighbours in an image mostly share theirs: runs of them are what is
/// worth a look.
struct CellRuns {
  std::size_t size = 0;
  std::uint32_t first[kBatch + 1];  ///< first point of each run, and the end
  std::int32_t a[kBatch];           ///< of each point
  std::int32_t b[kBatch];

  /// \p n <= kBatch coordinates, in cells; kOutside stays.
  void find(const double* u, const double* v, std::size_t n, const CellWindow& window);
};

/// World coordinates of the points and their cells: x = kOutside where one leaves the lattice.
/// \param m      rows of the 3 x 4 transform to world coordinates in units of cells
/// \param xyz    3 n values: coordinates in cells
void worldCells(const float* data, std::size_t stride, const int* indices, std::size_t n,
                const double* m, double* xyz, std::int32_t* cells);

}  // namespace planar_mapping::detail
