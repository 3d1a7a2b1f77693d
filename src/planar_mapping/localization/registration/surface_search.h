// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/localization/registration/surface_shape.h"

namespace planar_mapping::detail {

/// Planes that face the same way.
struct FacingPlanes {
  Vector3 normal = Vector3::Zero();
  std::vector<std::size_t> members;
};

/// Where a cloud may lie on a map when nobody knows: turns that bring the directions which many of
/// its small planes face onto those of the map, and moves along these directions that bring their
/// offsets together. [ours]
class SurfaceSearch {
 public:
  /// \param map planes of the map that are near enough, world frame
  SurfaceSearch(const SurfaceMapParams& params, const BalancedPlanes& cloud,
                std::vector<Surfel> map);

  /// Poses T_sensor_world, the best first; none where the cloud's planes face one way only.
  /// \param guess T_world_sensor; along what the planes leave open the cloud stays there
  std::vector<Pose> candidates(const Pose& guess) const;

  /// Whether five planes, apart in direction or offset, of the cloud lie on the map.
  bool knowsPlace(const Pose& T_world_sensor) const;

 private:
  std::vector<Matrix3> turns() const;
  std::vector<Vector3> moves(const Matrix3& turn, const Pose& guess) const;
  double fitOf(const Surfel& plane, const Pose& T_world_sensor) const;
  double fitOf(const Pose& T_world_sensor) const;

  const SurfaceMapParams& params_;
  const BalancedPlanes& cloud_;
  std::vector<Surfel> map_;
  std::vector<FacingPlanes> cloud_directions_;
  std::vector<FacingPlanes> map_directions_;
  PlaneNeighbours nearby_;
};

}  // namespace planar_mapping::detail
