// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/plan/plan.h"

namespace planar_mapping {

/// A point cloud drawn over the map, in the map's frame, metres. Non-finite points are not drawn.
struct SceneCloud {
  std::vector<float> xyz;         ///< three per point
  std::vector<std::uint8_t> rgb;  ///< three per point, or empty: one colour for the whole cloud
  std::size_t size() const { return xyz.size() / 3; }
  Vector3 point(std::size_t i) const { return {xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]}; }
};

/// What is drawn: plain data between a map and the picture of it, so that anything that has
/// cuboids can be shown. World frame of the map, metres.
struct PLANAR_MAPPING_EXPORT SceneContent {
  std::vector<Cuboid> cuboids;        ///< occupied ones; Cuboid::size holds full lengths
  std::vector<Cuboid> unknown;        ///< unknown space
  std::vector<Cuboid> free;           ///< what was seen free, for plans; see unseen
  Unseen unseen = Unseen::Free;       ///< what space is of which neither says anything
  std::vector<Pose> trajectory;       ///< T_world_sensor per frame, in order
  bool sensors_known = true;          ///< the trajectory says where space was seen from
  std::vector<GroundPoint> ground;    ///< PlanarMap::ground(): plans follow it
  std::vector<MeasuredCells> floors;  ///< measuredFloors(): plans need them
  std::vector<SceneCloud> clouds;     ///< overlays
  std::size_t planes = 0;             ///< number of planes, for the legend; 0 = count the ids
  double resolution = 0.0;            ///< side s of a cell, for the legend; 0 = not known
  Vector3 up = Vector3::UnitZ();      ///< against gravity: ground grid, height, tilt, cameras

  bool empty() const { return cuboids.empty() && unknown.empty() && cloudPoints() == 0; }
  std::size_t cloudPoints() const;
  /// What pictures show whole: the cuboids without those more than twice as far out as those reach
  /// that hold 95 % of all surface. Stray returns would leave the rest a spot in the picture.
  std::vector<const Cuboid*> framed() const;
  /// Axis-aligned bounds of framed(), clouds and, where sensors are known, trajectory (unknown
  /// space only if there is nothing else), metres; false if there is nothing at all.
  bool bounds(Vector3& low, Vector3& high) const;
  /// \throws InputError naming the first cuboid, pose or cloud that cannot be drawn: a number that
  ///         is not finite, a negative length, a zero quaternion, a zero up axis, array sizes that
  ///         disagree
  void validate() const;
};

/// The content of a map, with its up axis.
PLANAR_MAPPING_EXPORT SceneContent sceneContent(const PlanarMap& map);

/// Angle between the cuboid's plane and the ground, radians in [0, pi/2]: the absolute value of
/// the normalised tilt (the paper, Eq. 2-3) of its normal with respect to \p up.
PLANAR_MAPPING_EXPORT double tiltOf(const Cuboid& cuboid, const Vector3& up);

/// Height of the cuboid's centre along \p up, metres.
PLANAR_MAPPING_EXPORT double heightOf(const Cuboid& cuboid, const Vector3& up);

/// [ours] Do the poses look along their own z axis (optical frame: x right, y down, z forward)?
/// True if at least \p fraction of the occupied cuboids lie within about 60 degrees of the z axis
/// of some pose. Otherwise they are taken as robot frames: x forward, z up.
PLANAR_MAPPING_EXPORT bool looksAlongZ(const SceneContent& content, double fraction = 0.9);

}  // namespace planar_mapping
