// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/cuboids/cuboid_approximation.h"
#include "planar_mapping/cuboids/raster/plane_raster.h"

namespace planar_mapping::detail {

/// Length in cells of a threshold that stands for the resolution when it is 0; at least 1.
int lengthInCells(double length, double resolution);

/// The thickness that 0 stands for.
double thicknessOf(const CuboidApproximationParams& params);

/// A cell takes part as a whole unless a box can stand for the half cell next to it.
inline bool isTolerant(const CuboidApproximationParams& params) {
  return params.absorption >= 0.5;
}

/// Fills empty cells enclosed by occupied ones (in the sense of 4-connected holes) where the
/// hole's bounding rectangle is at most \p side cells wide and high.
void fillHoles(CellMask& mask, int side);

}  // namespace planar_mapping::detail
