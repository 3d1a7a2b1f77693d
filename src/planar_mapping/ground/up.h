// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {

/// The direction upwards, by the planes of a cloud.
struct Upright {
  bool found = false;             ///< false: take the sensor for level
  Vector3 up = Vector3::UnitZ();  ///< unit length, sensor's frame; expected_up unless found
  double tilt = 0.0;              ///< between up and expected_up
  double horizontal = 0.0;        ///< fraction of the points on horizontal planes
  double vertical = 0.0;          ///< ... on vertical ones
  /// Nothing is horizontal by it, or was by what was found instead, and half of the points are on
  /// planes of one direction: they may be walls or floors.
  bool is_uncertain = false;
};

/// Finds the direction upwards in a cloud from what people build: floors, ceilings and tables are
/// horizontal, walls and sides of furniture vertical.
///
/// Candidates are the normals of planes and the lines in which two planes meet, within 65 degrees
/// of level; beyond 25 degrees something horizontal has to be below the sensor. The one that makes
/// most of the points lie on horizontal or vertical planes is taken, if there are vertical ones to
/// confirm it or most of the points are on one plane below the sensor, if level does not explain as
/// much, and if no other direction does; then it is fitted to all of those planes. O(planes^3), at
/// most the 20 largest count.
/// \param planes       with the sensor at the origin
/// \param expected_up  upwards if the sensor stands level, in its frame; of any length
/// \throws ParameterError if expected_up is zero or not finite
PLANAR_MAPPING_EXPORT Upright findUpright(const std::vector<PlaneSegment>& planes,
                                          const Vector3& expected_up);
/// The planes of a cloud that findUpright() and upOf() look at.
PLANAR_MAPPING_EXPORT std::vector<PlaneSegment> planesFor(const PointsView& points,
                                                          const std::optional<StereoNoise>& noise);

/// What the given poses of a camera say about the vertical of their world.
struct ImagesUp {
  Vector3 mean =
      Vector3::UnitZ();  ///< upwards in the images, world frame; mean over all poses, any length
  bool starts_at_identity = false;  ///< the world is the frame of the first camera
};

/// The vertical of the world of given poses.
struct WorldUp {
  Vector3 up = Vector3::UnitZ();  ///< unit length
  bool is_leaning = false;        ///< by the planes; else it is an axis of the world
  /// The planes that say so may be walls as well as floors.
  bool is_uncertain = false;
};

/// Which way is up in a world of given poses.
///
/// Upwards is z where the images of all poses have upwards within 75 degrees of z and the first
/// pose is not the identity; else it is the axis of the world closest to upwards in the images.
/// The planes of the first frame overrule z where floors and walls together lean against it by
/// more than 10 degrees, and another axis where floors or walls do by more than 5. Where the motion
/// is estimated the world is made level by the same planes, and z is upwards.
/// \param image_axis      the axis of the world closest to upwards in the first image
/// \param images          of all poses, where they are known before
/// \param T_world_sensor  pose of the first frame
/// \param planes          what that frame sees, with the sensor at the origin
PLANAR_MAPPING_EXPORT WorldUp upOf(const Vector3& image_axis, const std::optional<ImagesUp>& images,
                                   const Pose& T_world_sensor,
                                   const std::vector<PlaneSegment>& planes);

}  // namespace planar_mapping
