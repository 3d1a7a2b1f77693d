// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "cuboids/absorption.h"
#include "planar_mapping/core/cuboids/cuboid_approximation.h"

namespace planar_mapping::detail {

/// What lies on no plane, in cells of the grid of all space.
struct RestCells {
  std::vector<NonPlanarCell> cells;  ///< in order of first appearance
  std::size_t points = 0;            ///< placed in the grid, absorbed or not
  std::size_t absorbed = 0;
  std::size_t dropped = 0;  ///< not finite, or where floats are coarser than the grid
};

/// \param indices points that count, or null for all
/// \param volume  points in it are absorbed; null = none
RestCells collectRest(const PointsView& points, const Indices* indices, double resolution,
                      const PlanarVolume* volume, const std::vector<float>* probability);

/// Number of different cells of the grid that hold points.
std::size_t countCells(const PointsView& points, const Indices* indices, double resolution);

}  // namespace planar_mapping::detail
