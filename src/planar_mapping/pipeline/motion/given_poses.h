// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "planar_mapping/pipeline/motion/frame_locator.h"
#include "planar_mapping/localization/odometry/odometry.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping::detail {

/// [ours] What features and clouds say of given poses.
struct GivenPoses {
  bool contradicted = false;              ///< which is said once
  std::int32_t agreed = 0;                ///< frames before
  Pose T_world_given = Pose::Identity();  ///< by the last frame that had both poses
  std::int32_t uncorrected = 0;           ///< frames without features since a cloud told
  std::optional<Odometry> before;         ///< the features of the frame before, at its given pose
  Pose given_before = Pose::Identity();   ///< that pose
  std::size_t still_since = 0;            ///< frame from which on given poses are the same ...
  std::int32_t moving = 0;                ///< ... and so many were seen to move

  /// A warning if a frame is elsewhere than its given pose says, or that stays the same while the
  /// camera moves.
  /// \pre frame.given_pose
  std::optional<std::string> contradictionOf(const Frame& frame, const FrameLocator& locator);

  /// All but the features of the frame before.
  template <typename Archive>
  void visitState(Archive& archive) {
    archive(contradicted, agreed, T_world_given, uncorrected, given_before, still_since, moving);
  }

 private:
  std::optional<std::string> standstillOf(const Frame& frame, const FrameLocator& locator);
  std::optional<std::string> offsetOf(const Frame& frame, const Odometry& odometry);
  std::string causeOf(const Frame& frame) const;
};

}  // namespace planar_mapping::detail
