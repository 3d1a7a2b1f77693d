// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/pipeline/keyframe_view.h"
#include "planar_mapping/pipeline/motion/frame_locator.h"
#include "planar_mapping/pipeline/motion/motion_keys.h"
#include "planar_mapping/pipeline/rounded.h"
#include "planar_mapping/pipeline/stages/builtin.h"

namespace planar_mapping::detail {
namespace {

/// Gives each frame its pose: the given one, or where its image and its cloud lie among those of
/// frames before. A frame for which nothing tells that begins a track of its own (Frame::track).
class MotionEstimationStage : public Stage {
 public:
  static constexpr const char* kName = "motion_estimation";
  static constexpr const char* kSummary =
      "finds the pose of the frame from features and surfaces (the paper, Eq. 8) or takes a given "
      "one";
  static constexpr StageKind kKind = StageKind::Motion;

  void declare(ParameterTable& table) override { keys_.declare(table); }
  void configure(const RunSettings&) override { keys_.configure(); }
  void adapt(const CloudScale& scale) override {
    keys_.noise.adapt(scale);
    locator_.setOptical(scale.optical);
    keys_.adapt(scale.optical);
  }
  void process(Frame& frame) override {
    if (frame.given_pose && keys_.poses == MotionKeys::Poses::Use) {
      if (checked_ < kCheckedFrames && showsItsCloud(frame)) checkGiven(frame);
      takeGiven(frame);
    } else {
      find(frame);
    }
    const bool has_step = frame.motion && frame.skip_reason.empty();
    frame.statistics.push_back(
        {"motion_step_m", has_step ? frame.motion->T_now_before.translation().norm() : 0.0});
  }

 private:
  void takeGiven(Frame& frame);
  void checkGiven(Frame& frame);
  void find(Frame& frame);
  /// Of the step between two given poses.
  Matrix6 stepCovariance() const {
    Matrix6 covariance = Matrix6::Zero();
    covariance.diagonal() << Vector3::Constant(std::pow(keys_.given_position_error, 2)),
        Vector3::Constant(std::pow(keys_.given_orientation_error, 2));
    return 2.0 * covariance;
  }

  static constexpr int kCheckedFrames = 4;  ///< the first, whose images check given poses

  MotionKeys keys_;
  FrameLocator locator_{keys_};
  std::map<std::size_t, std::optional<Pose>> last_;  ///< T_world_sensor, by track
  std::optional<std::size_t> given_track_;           ///< that of the world of given poses
  int checked_ = 0;                    ///< frames whose given pose was compared with their images
  std::optional<Pose> T_given_found_;  ///< by the first of them
};

}  // namespace

void MotionEstimationStage::takeGiven(Frame& frame) {
  frame.T_world_sensor = *frame.given_pose;
  // How that world lies to one that began with a frame that has no pose is not known.
  if (!given_track_) given_track_ = last_.empty() ? 0 : std::numeric_limits<std::size_t>::max();
  frame.track = *given_track_;
  std::optional<Pose>& last = last_[frame.track];
  if (last) frame.motion = FrameMotion{frame.T_world_sensor.inverse() * *last, stepCovariance()};
  last = frame.T_world_sensor;
}

/// Poses of another camera, unit or convention show in the first frames.
void MotionEstimationStage::checkGiven(Frame& frame) {
  constexpr std::size_t kMinInliers = 20;
  constexpr double kMaxDistance = 0.1;  // metres
  constexpr double kMaxTurn = 5.0;      // degrees
  ++checked_;
  Frame copy = frame;  // its notes and its world are not wanted
  const std::optional<Localization> found = locator_.locate(copy, nullptr);
  if (!found || found->submap != 0) return;
  if (!T_given_found_) T_given_found_ = *frame.given_pose * found->T_submap_camera.inverse();
  const Pose apart = frame.given_pose->inverse() * *T_given_found_ * found->T_submap_camera;
  const double distance = apart.translation().norm();
  const double turn = rotationAngle(apart.linear()) / kRadiansPerDegree;
  if (found->evidence.inliers < kMinInliers || (distance < kMaxDistance && turn < kMaxTurn)) return;
  frame.warnings.push_back(
      "frame " + std::to_string(frame.number) + " " + frame.source +
      ": its given pose contradicts the images: " + std::to_string(found->evidence.inliers) +
      " of " + std::to_string(found->evidence.expected) + " known features put it " +
      rounded(distance, 2) + " m and " + rounded(turn, 1) +
      " degrees elsewhere; are they poses of this camera in the world (z forward, y down), in "
      "metres, and is calib.yaml right? --set motion_estimation.poses=ignore finds them");
  checked_ = kCheckedFrames;
}

void MotionEstimationStage::find(Frame& frame) {
  const Matrix6 step_covariance = stepCovariance();
  const std::optional<Localization> found =
      locator_.locate(frame, keys_.poses == MotionKeys::Poses::Prior ? &step_covariance : nullptr);
  if (!found) {
    frame.skip_reason = "it has no image of the size of its cloud, unlike the first frame";
    return;
  }
  frame.inliers = found->evidence.inliers;
  frame.matches = found->evidence.expected;
  frame.statistics.push_back({"motion_log_odds", found->evidence.log_odds});
  frame.T_world_sensor = found->T_submap_camera;
  frame.track = found->submap;
  frame.joined = found->joined;
  frame.drift = found->drift_in_camera;
  if (given_track_ == 0u) {
    if (frame.joined) ++frame.joined->submap;
    if (frame.track == 0 && T_given_found_) {
      frame.T_world_sensor = *T_given_found_ * frame.T_world_sensor;
      if (frame.joined)
        frame.joined->T_other_submap = *T_given_found_ * frame.joined->T_other_submap;
    } else {
      ++frame.track;
    }
    frame.starts_world = false;
  }
  std::optional<Pose>& last = last_[frame.track];
  if (last)
    frame.motion = FrameMotion{frame.T_world_sensor.inverse() * *last, found->covariance_in_camera};
  last = frame.T_world_sensor;
}

void addMotionEstimation(StageTable& table) {
  table.add<MotionEstimationStage>();
}

}  // namespace planar_mapping::detail
