// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping {

/// Which steps are taken.
enum class Profile : std::uint8_t {
  Paper,    ///< nothing beyond the paper
  Compact,  ///< [ours] few rectangles and boxes, with a tolerance of half a cell
};

/// How planes and cells become cuboids (the paper, III-F). Lengths in metres.
struct PLANAR_MAPPING_EXPORT CuboidApproximationParams {
  Profile profile = Profile::Compact;
  double resolution = 0.1;         ///< s, side of the smallest cell, > 0
  double thickness = 0.0;          ///< extension along -n; 0 = resolution
  double density_threshold = 0.9;  ///< D_T of the split, in (0, 1]
  double min_width = 0.0;          ///< W_T; 0 = resolution
  double min_height = 0.0;         ///< H_T; 0 = resolution
  int min_points_per_cell = 1;     ///< cells with fewer points are empty, >= 1
  /// [ours] compact: holes of a patch up to this side are filled; 0 = resolution, less = off
  double hole_size = 0.0;
  /// [ours] compact: points within this many cells of a cuboid need none of their own, in [0, 0.5]
  double absorption = 0.5;
  /// [ours] compact: a plane's rectangle of fewer cells of its own is left to the boxes, >= 0
  double rectangle_cells = 4.0;
  Vector3 up =
      Vector3::UnitZ();  ///< up in the world: the first axis of a plane's cuboid is horizontal
  int threads = 1;

  /// \throws ParameterError
  void validate() const;
};

}  // namespace planar_mapping
