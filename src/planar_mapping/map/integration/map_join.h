// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "planar_mapping/map/sensor/frame_observation.h"
#include "planar_mapping/map/store/map_data.h"

namespace planar_mapping::detail {

/// Does another map fit to this one? \return the pose, its rotation normalised
/// \throws InputError as PlanarMap::merge() does
Pose requireJoinable(const MapData& map, const MapData& other, const Pose& T_map_other);

/// A map where a rigid motion puts it. Rasters ride along with their planes; non-planar cells and
/// space are resampled, cell by nearest cell.
/// \throws InputError if that is too much space: see movedSpace()
MapData placedMap(const MapData& map, const Pose& T);

/// Of planes and cells, metres.
Eigen::AlignedBox3d boundsOf(const MapData& map);

/// Whether the map that is added was made after the other.
enum class Order : std::uint8_t { Unknown, Later };

/// Adds what another map of the same world knows. Its planes are associated like those of a frame;
/// beliefs of cells of both are added; of what a later one saw free the cells are gone; cells that
/// lie in a plane are given up.
FrameUpdate joinMap(MapData& map, const MapData& other, Order order);

}  // namespace planar_mapping::detail
