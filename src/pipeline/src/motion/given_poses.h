// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "planar_mapping/core/odometry/odometry.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping::detail {

/// [ours] What features and clouds say of given poses.
struct GivenPoses {
  bool contradicted = false;              ///< which is said once
  std::int32_t agreed = 0;                ///< frames before
  Pose T_world_given = Pose::Identity();  ///< by the last frame that had both poses
  std::int32_t uncorrected = 0;           ///< frames without features since a cloud told

  /// A warning if the features of a frame are elsewhere than its given pose says.
  /// \pre frame.given_pose
  /// \param last  pose of the frame before
  std::optional<std::string> contradictionOf(const Frame& frame, const Odometry& odometry,
                                             const std::optional<Pose>& last);
};

}  // namespace planar_mapping::detail
