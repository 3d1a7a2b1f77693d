// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"
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
    optical_ = scale.optical;
    keys_.adapt(optical_);
  }
  void process(Frame& frame) override {
    if (frame.given_pose && keys_.poses == MotionKeys::Poses::Use) {
      if (checked_ < kCheckedFrames) checkGiven(frame);
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
  bool optical_ = true;  ///< clouds are in a camera's frame, z forward; else x forward, z up
  FrameLocator locator_{keys_};
  struct Track {
    Pose T_world_start = Pose::Identity();
    std::optional<Pose> last;  ///< T_world_sensor
  };
  std::map<std::size_t, Track> tracks_;
  int checked_ = 0;                ///< frames whose given pose was compared with their images
  std::optional<Pose> T_checked_;  ///< of the first of them, as given
};

}  // namespace

void MotionEstimationStage::takeGiven(Frame& frame) {
  frame.T_world_sensor = *frame.given_pose;
  frame.pose_taken = true;
  Track& track = tracks_[0];
  if (track.last)
    frame.motion = FrameMotion{frame.T_world_sensor.inverse() * *track.last, stepCovariance()};
  track.last = frame.T_world_sensor;
}

/// Poses of another camera, unit or convention show in the first frames.
void MotionEstimationStage::checkGiven(Frame& frame) {
  constexpr std::size_t kMinInliers = 20;
  constexpr double kMaxDistance = 0.1;  // metres
  constexpr double kMaxTurn = 5.0;      // degrees
  ++checked_;
  const std::optional<Localization> found = locator_.locate(frame, nullptr);
  if (!found || found->submap != 0) return;
  if (!T_checked_) T_checked_ = *frame.given_pose;
  const Pose given = T_checked_->inverse() * *frame.given_pose;
  const Pose apart = given.inverse() * found->T_submap_camera;
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
  frame.track = found->submap;
  Track& track = tracks_[frame.track];
  if (found->joined) {
    const Pose& T_world_track = track.T_world_start;
    frame.joined = *found->joined;
    frame.joined->T_other_submap = T_world_track * found->joined->T_other_submap *
                                   tracks_[found->joined->submap].T_world_start.inverse();
    const Matrix6 A = adjoint(T_world_track);
    frame.joined->covariance = A * found->joined->covariance * A.transpose();
  }
  if (found->begins_submap) {
    const bool is_prior = keys_.poses == MotionKeys::Poses::Prior && frame.given_pose;
    track.T_world_start =
        is_prior ? *frame.given_pose : keys_.start.of(frame, optical_, keys_.noise.optionalNoise());
    frame.starts_world = !frame.given_pose || !(is_prior || keys_.start.isGiven());
  }
  frame.T_world_sensor = track.T_world_start * found->T_submap_camera;
  if (track.last)
    frame.motion =
        FrameMotion{frame.T_world_sensor.inverse() * *track.last, found->covariance_in_camera};
  track.last = frame.T_world_sensor;
}

void addMotionEstimation(StageTable& table) {
  table.add<MotionEstimationStage>();
}

}  // namespace planar_mapping::detail
