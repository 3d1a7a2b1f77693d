// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/cuboids/compact_cover.h"
#include "planar_mapping/map/store/map_data.h"

namespace planar_mapping::detail {

// Where covers and boxes are among the blocks and regions of cells.

inline Vector3 centerOf(const LooseQuarter& quarter, const PlaneFrame& frame, double s) {
  return frame.fromPlane({0.5 * s * (quarter.a + 0.5), 0.5 * s * (quarter.b + 0.5), 0.0});
}

/// The block of cells around a point, within the lattice.
inline Int3 blockOf(const Vector3& point, double s) {
  constexpr double kLimit = kLatticeLimit / 4;
  const Vector3 at = (point / (4.0 * s)).array().floor().max(-kLimit).min(kLimit - 1.0);
  return toInt3(at);
}

inline std::uint64_t regionOf(const MapData& map, const Vector3& point) {
  return map.cells.regionKey(blockOf(point, map.resolution()));
}

/// World bounds of a cuboid, and so far around it.
inline Eigen::AlignedBox3d boundsOf(const Cuboid& cuboid, double margin) {
  const Vector3 half = reach(cuboid) + Vector3::Constant(margin);
  return {cuboid.center - half, cuboid.center + half};
}

/// Gives boxes that lie on a plane its id: parallel to it within the angle of association, at most
/// two cells thick, within half a cell of the plane, and at least half of the face over cells of
/// this one plane. Their axes are renamed to u, v, n; they do not move.
/// \param near  planes that have cells where the boxes are
void namePlanes(const MapData& map, const std::vector<const PlaneLayer*>& near,
                std::vector<Cuboid>& boxes);

}  // namespace planar_mapping::detail
