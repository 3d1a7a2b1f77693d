// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/cuboids/cuboid_approximation.h"

namespace planar_mapping {

void CuboidApproximationParams::validate() const {
  constexpr double kLargestLength = 1e6;  // metres; more is a mistake of units
  requireInRange("profile", static_cast<int>(profile), 0, static_cast<int>(Profile::Compact));
  requireInRange("resolution", resolution, 1e-4, kLargestLength, "m");
  requireInRange("thickness", thickness, 0.0, kLargestLength, "m");
  requirePositive("density_threshold", density_threshold);
  requireInRange("density_threshold", density_threshold, 0.0, 1.0);
  requireInRange("min_width", min_width, 0.0, kLargestLength, "m");
  requireInRange("min_height", min_height, 0.0, kLargestLength, "m");
  requireInRange("min_points_per_cell", min_points_per_cell, 1, 1e9);
  requireInRange("hole_size", hole_size, 0.0, kLargestLength, "m");
  requireInRange("absorption", absorption, 0.0, 0.5, "cells");
  requireInRange("rectangle_cells", rectangle_cells, 0.0, 1e9, "cells");
  requireInRange("threads", threads, 0, 4096);
  if (!up.allFinite() || !(up.norm() > 0.0)) {
    throw ParameterError("up", up.norm(), "a finite vector of length > 0");
  }
}

}  // namespace planar_mapping
