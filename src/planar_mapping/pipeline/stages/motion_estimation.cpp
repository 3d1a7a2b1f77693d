// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>

#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/pipeline/motion/frame_locator.h"
#include "planar_mapping/pipeline/motion/motion_keys.h"
#include "planar_mapping/pipeline/rounded.h"
#include "planar_mapping/pipeline/stages/builtin.h"
#ifdef PLANAR_MAPPING_HAS_STEREO
#include "planar_mapping/pipeline/motion/submap_locator.h"
#endif

namespace planar_mapping::detail {
namespace {

using Poses = MotionKeys::Poses;
using Clouds = MotionKeys::Clouds;

/// Whether next to none of the features agree with a pose: seats, posts and panels repeat, what is
/// on them does not.
bool contradict(const Odometry& odometry, const Frame& frame, const Pose& T_world_sensor) {
  constexpr std::size_t kFewest = 15;
  constexpr double kLeast = 0.1;  // of them: 0.39 and more agree with right places, 0.04 with wrong
  const PosePrior there{T_world_sensor, Matrix6::Identity(), true};
  const OdometryResult result = odometry.locate(frame.key_features, there);
  return result.matches >= kFewest &&
         static_cast<double>(result.inliers) < kLeast * static_cast<double>(result.matches);
}

/// Gives each frame its pose: the given one, or the one at which FrameLocator and the features
/// agree. A frame that cannot be placed gets the reason (Frame::skip_reason).
class MotionEstimationStage : public Stage {
 public:
  static constexpr const char* kName = "motion_estimation";
  static constexpr const char* kSummary =
      "finds the pose of the frame from its key features (the paper, Eq. 8) or takes a given one";
  static constexpr StageKind kKind = StageKind::Motion;

  void declare(ParameterTable& table) override { keys_.declare(table); }
  void configure(const RunSettings& settings) override { keys_.configure(settings.seed); }
  void adapt(const CloudScale& scale) override {
    keys_.noise.adapt(scale);
    optical_ = scale.optical;
    keys_.adapt(optical_);
  }
  void process(Frame& frame) override;
  bool usesKeyFeatures(const Frame& frame) const override {
    return !takesGiven(frame) || checked_ < kCheckedFrames;
  }

 private:
  /// Whether the given pose is taken as it is, and nothing looked for.
  bool takesGiven(const Frame& frame) const {
    return frame.given_pose && keys_.poses == Poses::Use;
  }
  void prepare(const Frame& frame);
  void startLocator(bool with_clouds);
  void placeAgain(Frame& frame);
  void takeGiven(Frame& frame);
  void checkGiven(Frame& frame);
  std::optional<FrameLocator::Placement> placeDoubtful(const Frame& frame);
  Pose priorByCloud(const Frame& frame);
  void registerFrame(Frame& frame, bool given);
  std::optional<PosePrior> start(Frame& frame);
  FrameMotion motionTo(const Pose& T_world_sensor, const Matrix6& covariance) const;

  static constexpr int kCheckedFrames = 4;  ///< the first, whose features check given poses

  MotionKeys keys_;
#ifdef PLANAR_MAPPING_HAS_STEREO
  SubmapLocator submaps_;
#endif
  bool optical_ = true;  ///< clouds are in a camera's frame, z forward; else x forward, z up
  std::optional<FrameLocator> locator_;
  bool out_of_order_ = false;              ///< the last frame with a pose was one placed again
  Pose T_world_given_ = Pose::Identity();  ///< by the last frame that had both poses
  int uncorrected_ = 0;                    ///< frames without features since a cloud told
  int checked_ = 0;                        ///< frames whose given pose was compared with features
};

}  // namespace

void MotionEstimationStage::process(Frame& frame) {
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (keys_.method == MotionKeys::Method::Submaps && !takesGiven(frame)) {
    if (frame.again) {  // it was placed in its submap when it came
      frame.skip_reason = "it lies in a submap of its own";
      return;
    }
    const Matrix6 step_covariance =
        2.0 * poseCovariance(keys_.given_position_error, keys_.given_orientation_error);
    submaps_.place(frame,
                   submaps_.started()
                       ? Pose::Identity()
                       : keys_.start.of(frame, optical_, keys_.noise.optionalNoise()),
                   keys_.poses == Poses::Prior ? &step_covariance : nullptr);
    return;
  }
#endif
  if (!locator_) prepare(frame);
  if (takesGiven(frame)) {
    if (checked_ < kCheckedFrames) checkGiven(frame);
    takeGiven(frame);
  } else if (frame.again) {
    return placeAgain(frame);
  } else {
    registerFrame(frame, frame.given_pose && keys_.poses == Poses::Prior);
  }
  frame.statistics.push_back({"motion_step_m", frame.motion && frame.skip_reason.empty()
                                                   ? frame.motion->T_now_before.translation().norm()
                                                   : 0.0});
}

void MotionEstimationStage::prepare(const Frame& frame) {
  FeatureCamera& camera = keys_.odometry.camera;
  if (frame.camera) camera.setPinhole(*frame.camera);
  if (const std::optional<StereoNoise> noise = keys_.noise.optionalNoise()) {
    camera.depth_error = 0.0;
    camera.depth_error_growth = noise->disparity_error / (noise->baseline * noise->focal_length);
  }
  const bool pair = frame.baseline || !frame.images.right.empty();
  const bool with_clouds = keys_.clouds == Clouds::On || (keys_.clouds == Clouds::Auto && !pair);
  if (with_clouds) {
    if (keys_.cloud_cell) {
      keys_.surface.cell = *keys_.cloud_cell;
    } else if (frame.cloud) {
      keys_.surface.cell = surfaceCellFor(pointsOf(*frame.cloud), keys_.surface);
    }
    constexpr double kReachInCells = 6.0;
    keys_.surface.reach = keys_.cloud_reach.value_or(kReachInCells * keys_.surface.cell);
  }
  startLocator(with_clouds);
}

void MotionEstimationStage::startLocator(bool with_clouds) {
  locator_.emplace(keys_.odometry, with_clouds ? &keys_.surface : nullptr, keys_.enough_inliers);
}

/// A frame that was left out, against what has been seen since. It is no step of the odometry.
void MotionEstimationStage::placeAgain(Frame& frame) {
  frame.skip_reason = "it was left out before";
  if (!locator_->lastPose() || frame.image_doubtful) return;
  locator_->lookAt(frame);
  const std::optional<Pose> placed = locator_->placeAgain(frame);
  if (!placed) return;
  frame.skip_reason.clear();
  frame.T_world_sensor = *placed;
  frame.motion = motionTo(*placed, 2.0 * FrameLocator::covarianceByViews());
  locator_->remember(frame);
  locator_->setLastPose(*placed);
  out_of_order_ = true;
}

/// From the last frame that has a pose.
FrameMotion MotionEstimationStage::motionTo(const Pose& T_world_sensor,
                                            const Matrix6& covariance) const {
  FrameMotion motion;
  motion.T_now_before = T_world_sensor.inverse() * *locator_->lastPose();
  motion.covariance = covariance;
  return motion;
}

void MotionEstimationStage::takeGiven(Frame& frame) {
  frame.T_world_sensor = *frame.given_pose;
  frame.pose_taken = true;
  if (locator_->lastPose())
    frame.motion =
        motionTo(frame.T_world_sensor,
                 2.0 * poseCovariance(keys_.given_position_error, keys_.given_orientation_error));
  locator_->setLastPose(frame.T_world_sensor);
}

/// Poses of another camera, unit or convention show in the first frames.
void MotionEstimationStage::checkGiven(Frame& frame) {
  constexpr std::size_t kMinInliers = 20;
  constexpr double kMaxAgreeing = 0.3;  // of the features, with a wrong pose
  constexpr double kMaxDistance = 0.1;  // metres
  constexpr double kMaxTurn = 5.0;      // degrees
  ++checked_;
  Odometry& odometry = locator_->odometry();
  const PosePrior given{*frame.given_pose, Matrix6::Identity(), true};
  if (odometry.started()) {
    const OdometryResult there = odometry.locate(frame.key_features, given);
    const OdometryResult seen = odometry.locate(frame.key_features);
    const bool is_wrong =
        static_cast<double>(there.inliers) <= kMaxAgreeing * static_cast<double>(there.matches) &&
        seen.registered && seen.inliers >= std::max(kMinInliers, 2 * there.inliers);
    const Pose apart = frame.given_pose->inverse() * seen.T_world_sensor;
    const double distance = apart.translation().norm();
    const double turn = rotationAngle(apart.linear()) / kRadiansPerDegree;
    if (is_wrong && (distance > kMaxDistance || turn > kMaxTurn)) {
      frame.warnings.push_back(
          "frame " + std::to_string(frame.number) + " " + frame.source +
          ": its given pose contradicts the images: " + std::to_string(seen.inliers) + " of " +
          std::to_string(seen.matches) + " known features put it " + rounded(distance, 2) +
          " m and " + rounded(turn, 1) +
          " degrees elsewhere; are they poses of this camera in the world (z forward, y down), in "
          "metres, and is calib.yaml right? --set motion_estimation.poses=ignore finds them");
      checked_ = kCheckedFrames;
    }
  }
  odometry.update(frame.key_features, given);
}

/// Of a frame whose image may not be registered to its cloud: as if there were none, else near.
/// After a frame that was left out nobody knows how far the camera has moved: then a cloud alone
/// tells too little where things repeat.
std::optional<FrameLocator::Placement> MotionEstimationStage::placeDoubtful(const Frame& frame) {
  if (locator_->lostFrames() == 0) {
    Frame bare = frame;
    bare.images.left = io::Image();
    bare.key_features.clear();
    locator_->lookAt(bare);
    std::optional<FrameLocator::Placement> by_cloud = locator_->place(bare);
    locator_->lookAt(frame);
    if (by_cloud && by_cloud->prior &&
        !contradict(locator_->odometry(), frame, by_cloud->prior->T_world_sensor) &&
        !locator_->isBetterByFeatures(frame, by_cloud->prior->T_world_sensor) &&
        !locator_->isAmbiguous(by_cloud->prior->T_world_sensor)) {
      by_cloud->prior->exact = true;
      return by_cloud;
    }
  }
  std::optional<FrameLocator::Placement> by_image = locator_->place(frame);
  if (by_image && by_image->prior &&
      (!locator_->isStep(by_image->prior->T_world_sensor) ||
       (!locator_->isSeen() &&
        contradict(locator_->odometry(), frame, by_image->prior->T_world_sensor))))
    by_image.reset();
  return by_image;
}

/// Of a frame without features: the step from the frame before as given, and its cloud, each by its
/// covariance. A cloud farther off than both may be says nothing.
Pose MotionEstimationStage::priorByCloud(const Frame& frame) {
  constexpr double kCautious = 0.2;   // of its deviations: registration states them too large
  constexpr double kFarthest = 22.5;  // 99.9 % of the squared distances, 6 degrees of freedom
  const Pose expected = T_world_given_ * *frame.given_pose;
  const CloudRegistration near = locator_->nearBy(frame, expected);
  const Matrix6 of_given =
      ++uncorrected_ * poseCovariance(keys_.given_position_error, keys_.given_orientation_error);
  const Matrix6 of_both = of_given + kCautious * kCautious * near.covariance;
  const Vector6 off = motionDifference(Pose::Identity(), expected.inverse() * near.T_world_sensor);
  const Vector6 weighed = of_both.ldlt().solve(off);
  if (!near.found || off.dot(weighed) > kFarthest) return expected;
  uncorrected_ = 0;
  return expected * motionStep(of_given * weighed);
}

void MotionEstimationStage::registerFrame(Frame& frame, bool given) {
  locator_->lookAt(frame);
  Odometry& odometry = locator_->odometry();
  std::optional<PosePrior> prior;
  if (given) {
    prior = PosePrior{*frame.given_pose,
                      poseCovariance(keys_.given_position_error, keys_.given_orientation_error),
                      false, true};
    if (frame.key_features.empty()) {
      prior->T_world_sensor = priorByCloud(frame);
      prior->exact = !odometry.started();
    }
  } else if (!odometry.started()) {
    if (locator_->lastPose()) {
      frame.skip_reason = "no pose is given and nothing was seen before to find one by";
      return;
    }
    prior = start(frame);
  } else {
    const auto placement =
        frame.image_doubtful && frame.cloud ? placeDoubtful(frame) : locator_->place(frame);
    if (!placement) {
      locator_->leaveOut();
      odometry.update({});
      frame.skip_reason = frame.image_doubtful
                              ? "edges of its depth are not seen in its colour image, which may "
                                "not be registered to it (key_features.registered=true says it "
                                "is), and depth alone does not tell where it is"
                              : locator_->doubt();
      return;
    }
    prior = placement->prior;
  }
  const OdometryResult result = odometry.update(frame.key_features, prior);
  frame.matches = result.matches;
  frame.inliers = result.inliers;
  frame.statistics.push_back({"motion_rms_px", result.registered ? result.rms_px : 0.0});
  if (!result.registered) {
    locator_->leaveOut();
    frame.skip_reason = locator_->reasonFor(frame, result);
    return;
  }
  locator_->accept(result);
  frame.T_world_sensor = result.T_world_sensor;
  if (given) T_world_given_ = frame.T_world_sensor * frame.given_pose->inverse();
  if (result.keyframe) locator_->remember(frame);
  frame.motion = result.motion;
  if (out_of_order_ && frame.motion && locator_->lastPose()) {
    frame.motion->T_now_before = frame.T_world_sensor.inverse() * *locator_->lastPose();
    out_of_order_ = false;
  }
  locator_->setLastPose(frame.T_world_sensor);
  if (given && result.from_prior && !result.reason.empty())
    frame.notes.push_back(frame.source + ": given pose taken as it is: " + result.reason);
  if (result.jump)
    frame.notes.push_back(frame.source + ": a jump of " +
                          rounded(result.motion->T_now_before.translation().norm(), 3) +
                          " m, found by known features");
}

/// The first pose. A cloud to go by does not need features, nor does a frame that none follows. But
/// an image with hardly any waits for a better one: few others would be known by it.
std::optional<PosePrior> MotionEstimationStage::start(Frame& frame) {
  Odometry& odometry = locator_->odometry();
  odometry.setStart(keys_.start.of(frame, optical_, keys_.noise.optionalNoise()));
  frame.starts_world = !frame.given_pose || !keys_.start.isGiven();
  constexpr int kMaxWaits = 5;  // frames
  const bool has_cloud = locator_->usesClouds() && frame.cloud && !frame.cloud->empty();
  const bool waits =
      !frame.images.left.empty() && !frame.is_last && locator_->lostFrames() < kMaxWaits &&
      frame.key_features.size() < static_cast<std::size_t>(keys_.odometry.motion.min_matches);
  if ((!has_cloud || waits) && !frame.is_only) return std::nullopt;
  PosePrior prior;
  prior.T_world_sensor = odometry.expectedPose();
  prior.exact = true;
  return prior;
}

void addMotionEstimation(StageTable& table) {
  table.add<MotionEstimationStage>();
}

}  // namespace planar_mapping::detail
