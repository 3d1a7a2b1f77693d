// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/motion/submap_locator.h"

#include <string>

#include "planar_mapping/pipeline/keyframe_view.h"
#include "planar_mapping/pipeline/rounded.h"

namespace planar_mapping::detail {

void SubmapLocator::place(Frame& frame, const Pose& T_world_start, const Matrix6* step_covariance) {
  if (!showsItsCloud(frame)) {
    frame.skip_reason = "method: submaps needs an image and an organized cloud of its size";
    return;
  }
  if (!localizer_) {
    LocalizerParams params;
    if (frame.baseline) params.noise = SensorNoise::ofPair(frame.camera->fx, *frame.baseline);
    localizer_.emplace(params);
    T_world_start_ = T_world_start;
  }
  LocalizerFrame seen;
  seen.gray = io::toGray(frame.images.left);
  seen.cloud = pointsOf(*frame.cloud);
  seen.camera = *frame.camera;
  seen.timestamp = frame.timestamp;
  if (step_covariance != nullptr && frame.given_pose) {
    seen.prior = frame.given_pose;
    seen.prior_covariance = *step_covariance;
  }
  const Localization found = localizer_->locate(seen);
  frame.inliers = found.evidence.inliers;
  frame.matches = found.evidence.expected;
  frame.statistics.push_back({"motion_submap", static_cast<double>(found.submap)});
  frame.statistics.push_back({"motion_log_odds", found.evidence.log_odds});
  if (found.submap != 0) {
    frame.skip_reason = "it lies in submap " + std::to_string(found.submap) +
                        ", which nothing joins to the first one (log odds " +
                        rounded(found.evidence.log_odds, 1) + ")";
    return;
  }
  frame.starts_world = found.begins_submap && !frame.given_pose;
  frame.T_world_sensor = T_world_start_ * found.T_submap_camera;
  if (last_pose_) {
    FrameMotion motion;
    motion.T_now_before = frame.T_world_sensor.inverse() * *last_pose_;
    // Of the step in the sensor's frame.
    motion.covariance = found.covariance_in_camera;
    frame.motion = motion;
  }
  last_pose_ = frame.T_world_sensor;
}

}  // namespace planar_mapping::detail
