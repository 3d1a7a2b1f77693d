// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping {

/// What is known of a piece of space; the values are the 2-bit file labels of the paper, IV.
enum class CellState : std::uint8_t { Free = 0, Occupied = 1, Unknown = 2 };

/// "free", "occupied" or "unknown".
PLANAR_MAPPING_EXPORT const char* toString(CellState state);

/// Oriented rectangular cuboid (the paper, III-F): one s_i of the output set S.
///
/// The local axes are u (along the plane, horizontal), v = n x u (along the slope) and n (the
/// plane's normal, towards the sensor); size holds the full lengths along them, metres.
struct Cuboid {
  Vector3 center = Vector3::Zero();
  Quaternion orientation = Quaternion::Identity();  ///< local (u, v, n) axes to the cloud's frame
  Vector3 size = Vector3::Zero();
  std::int32_t plane_id = -1;  ///< index of the plane it lies on; -1 for non-planar
  float probability = 1.0f;    ///< belief that it is occupied, in [0, 1]
  CellState state = CellState::Occupied;

  double volume() const { return size.prod(); }
};

/// Is the point (same frame as the cuboid) inside or within \p margin metres of it?
PLANAR_MAPPING_EXPORT bool contains(const Cuboid& cuboid, const Vector3& point,
                                    double margin = 0.0);
/// Half sides of its axis-aligned bounds.
PLANAR_MAPPING_EXPORT Vector3 reach(const Cuboid& cuboid);
/// Half its extent along a direction of unit length.
PLANAR_MAPPING_EXPORT double halfAlong(const Cuboid& cuboid, const Vector3& direction);
/// The eight corners; bit 0, 1, 2 of the index choose the sign along u, v, n.
PLANAR_MAPPING_EXPORT std::array<Vector3, 8> corners(const Cuboid& cuboid);
/// Corners of the faces, counter-clockwise seen from outside.
constexpr int kCuboidFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                    {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

}  // namespace planar_mapping
