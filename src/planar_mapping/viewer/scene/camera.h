// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/viewer/scene/scene_content.h"
#include "planar_mapping/viewer/scene/view_options.h"

namespace planar_mapping {

/// A placed camera, world frame of the map.
struct CameraView {
  Vector3 position = Vector3::Zero();
  Vector3 focal_point = Vector3::UnitX();
  Vector3 view_up = Vector3::UnitZ();  ///< unit, at right angles to the line of sight
  bool parallel = false;               ///< parallel projection instead of perspective
  double view_angle = 0.5236;          ///< vertical field of view, radians (perspective)
  double parallel_scale = 1.0;         ///< half the visible height, metres (parallel)

  Vector3 direction() const { return (focal_point - position).normalized(); }
};

/// Places the camera of \p options so that the content fills the picture.
///
/// [ours] Iso looks down at 35 degrees from that of eight directions that sees the largest area of
/// planar cuboids from the side their normals point to, so that one looks at surfaces as the
/// robot did. FirstPerson is the last pose of the trajectory.
/// \throws InputError if there is nothing to look at, or FirstPerson without a trajectory
/// \throws ParameterError if position and focal point coincide or lie along view_up
PLANAR_MAPPING_EXPORT CameraView placeCamera(const SceneContent& content,
                                             const ViewOptions& options);

/// Height of the ground along content.up, metres: floorHeight() of the cuboids, else of the clouds
/// (without the lowest hundredth of the points) or the unknown space. [ours]
PLANAR_MAPPING_EXPORT double groundHeight(const SceneContent& content);

/// Two horizontal unit vectors that make (right, forward, up) a right-handed frame; for up = +z
/// they are +x and +y.
PLANAR_MAPPING_EXPORT void horizontalAxes(const Vector3& up, Vector3& right, Vector3& forward);

}  // namespace planar_mapping
