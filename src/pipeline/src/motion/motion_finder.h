// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "motion/frame_locator.h"
#include "motion/motion_keys.h"
#include "planar_mapping/core/odometry/odometry.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping::detail {

/// What features and clouds say of given poses.
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

/// Gives each frame its pose: the given one, or the one at which FrameLocator and the features
/// agree. A frame that cannot be placed gets the reason (Frame::skip_reason).
class MotionFinder {
 public:
  MotionKeys keys;

  /// Whether clouds are in a camera's frame, z forward; else x forward, z up.
  void setOptical(bool optical) {
    optical_ = optical;
    keys.surface.optical_axis = optical ? Vector3::UnitZ() : Vector3(Vector3::Zero());
  }
  void place(Frame& frame);

  std::string saveState() const;
  void loadState(const std::string& bytes);

 private:
  void prepare(const Frame& frame);
  void startLocator(bool with_clouds);
  void placeAgain(Frame& frame);
  void takeGiven(Frame& frame);
  std::optional<FrameLocator::Placement> placeDoubtful(const Frame& frame);
  Pose priorByCloud(const Frame& frame);
  void registerFrame(Frame& frame, bool given);
  std::optional<PosePrior> start(Frame& frame);
  FrameMotion motionTo(const Pose& T_world_sensor, const Matrix6& covariance) const;

  bool optical_ = true;
  std::optional<FrameLocator> locator_;
  bool out_of_order_ = false;  ///< the last frame with a pose was one placed again
  GivenPoses given_;
};

}  // namespace planar_mapping::detail
