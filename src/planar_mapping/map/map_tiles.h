// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include "planar_mapping/base/export.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {

/// Bounds of all that a map knows, space included, metres; empty if it knows nothing.
PLANAR_MAPPING_EXPORT Eigen::AlignedBox3d reachOf(const PlanarMap& map);

/// Tiles along x and y that share no space: the least multiple of the cubes of 32 cells of space
/// that is at least as long. \param side  metres, > 0
PLANAR_MAPPING_EXPORT double tileSide(const PlanarMapParams& params, double side);

/// What lies in tile (x, y) of a map, which spans [x, x + 1) times the side along x and likewise
/// along y: cells by their middle, space, and the frames that were taken there or that its cells
/// were last seen from, at least one. Planes keep their numbers and fits. PlanarMap::merge() of all
/// tiles has all of the map. \param side  of tileSide() \return a map without frames if nothing
/// lies there \throws InputError for a finished map
PLANAR_MAPPING_EXPORT PlanarMap tileOf(const PlanarMap& map, double side, int x, int y);

}  // namespace planar_mapping
