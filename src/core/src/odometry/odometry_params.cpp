// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <limits>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/odometry/odometry.h"

namespace planar_mapping {

void OdometryParams::validate() const {
  constexpr double kLargest = std::numeric_limits<double>::max();
  camera.validate();
  motion.validate();
  requirePositive("keyframe_translation", keyframe_translation);
  requirePositive("keyframe_rotation", keyframe_rotation, "rad");
  requireInRange("keyframe_overlap", keyframe_overlap, 0.0, 1.0);
  requireInRange("max_landmarks", max_landmarks, 100, kLargest);
  requirePositive("jump_distance", jump_distance, "m");
  requireInRange("jump_inlier_share", jump_inlier_share, 0.0, 1.0);
  requireInRange("jump_inliers", jump_inliers, 0, kLargest);
}

}  // namespace planar_mapping
