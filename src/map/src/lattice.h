// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "key_map.h"

namespace planar_mapping::detail {

/// Cell of a point that is not finite or lies beyond the lattice.
constexpr std::int32_t kOutside = -kLatticeLimit - 1;
/// Points handled at once by the loops below.
constexpr std::size_t kBatch = 512;

/// a = floor(m0 x + m1 y + m2 z + m3) and b = floor(m4 x + ...) of \p n <= kBatch points of a
/// strided cloud; kOutside where it leaves the lattice.
void planeCells(const float* data, std::size_t stride, const int* indices, std::size_t n,
                const double* m, std::int32_t* a, std::int32_t* b);

/// Widens {low u, low v, high u, high v} by the same functions of the finite points, unrounded.
void planeExtent(const float* data, std::size_t stride, const int* indices, std::size_t n,
                 const double* m, double* extent);

/// World coordinates of the points and their cells: x = kOutside where one leaves the lattice.
/// \param m      rows of the 3 x 4 transform to world coordinates in units of cells
/// \param xyz    3 n values: coordinates in cells
void worldCells(const float* data, std::size_t stride, const int* indices, std::size_t n,
                const double* m, double* xyz, std::int32_t* cells);

}  // namespace planar_mapping::detail
