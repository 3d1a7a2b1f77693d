// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <string>

#include "builtin.h"
#include "frame_locator.h"
#include "motion_keys.h"
#include "planar_mapping/core/base/detail/state_archive.h"

namespace planar_mapping {
namespace {

using Poses = detail::MotionKeys::Poses;
using Clouds = detail::MotionKeys::Clouds;
using detail::poseCovariance;

constexpr double kReachInCells = 6.0;

class MotionEstimationStage : public Stage, private detail::MotionKeys {
 public:
  static constexpr const char* kName = "motion_estimation";
  static constexpr const char* kSummary =
      "finds the pose of the frame from its key features (the paper, Eq. 8) or takes a given one";
  static constexpr StageKind kKind = StageKind::Motion;

  void declare(ParameterTable& table) override { declareKeys(table); }
  void configure(const RunSettings& settings) override { configureKeys(settings.seed); }
  void adapt(const CloudScale& scale) override {
    noise_.adapt(scale);
    optical_ = scale.optical;
  }
  void process(Frame& frame) override {
    if (!locator_) prepare(frame);
    if (frame.again) {
      placeAgain(frame);
      return;
    }
    const bool given = frame.given_pose && poses_ != Poses::Ignore;
    if (given && poses_ == Poses::Use && frame.key_features.empty()) {
      takeGiven(frame);
    } else {
      registerFrame(frame, given);
    }
    frame.statistics.push_back(
        {"motion_step_m", frame.motion && frame.skip_reason.empty()
                              ? frame.motion->T_now_before.translation().norm()
                              : 0.0});
  }
  std::string saveState() const override;
  void loadState(const std::string& bytes) override;

 private:
  void prepare(const Frame& frame) {
    FeatureCamera& camera = params_.camera;
    if (frame.camera) {
      camera.fx = frame.camera->fx;
      camera.fy = frame.camera->fy;
      camera.cx = frame.camera->cx;
      camera.cy = frame.camera->cy;
    }
    if (const std::optional<StereoNoise> noise = noise_.optionalNoise()) {
      camera.depth_error = 0.0;
      camera.depth_error_growth = noise->disparity_error / (noise->baseline * noise->focal_length);
    }
    const bool pair = frame.baseline || !frame.images.right.empty();
    const bool with_clouds = clouds_ == Clouds::On || (clouds_ == Clouds::Auto && !pair);
    if (with_clouds) {
      if (cloud_cell_) {
        surface_params_.cell = *cloud_cell_;
      } else if (frame.cloud) {
        surface_params_.cell = surfaceCellFor(viewOf(*frame.cloud), surface_params_);
      }
      surface_params_.reach = cloud_reach_.value_or(kReachInCells * surface_params_.cell);
    }
    begin(with_clouds);
  }

  void begin(bool with_clouds) {
    surface_params_.optical_axis = optical_ ? Vector3::UnitZ() : Vector3(Vector3::Zero());
    locator_.emplace(params_, with_clouds ? &surface_params_ : nullptr, enough_inliers_);
  }

  /// A frame that was left out, against what has been seen since. It is no step of the odometry.
  void placeAgain(Frame& frame) {
    frame.skip_reason = "it was left out before";
    if (!locator_->lastPose()) return;
    locator_->lookAt(frame);
    const std::optional<Pose> placed = locator_->placeAgain(frame);
    if (!placed) return;
    frame.skip_reason.clear();
    frame.T_world_sensor = *placed;
    frame.motion = motionTo(*placed, 2.0 * detail::FrameLocator::covarianceByViews());
    locator_->remember(frame);
    locator_->setLastPose(*placed);
    out_of_order_ = true;
  }

  /// From the last frame that has a pose.
  FrameMotion motionTo(const Pose& T_world_sensor, const Matrix6& covariance) const {
    FrameMotion motion;
    motion.T_now_before = T_world_sensor.inverse() * *locator_->lastPose();
    motion.covariance = covariance;
    return motion;
  }

  /// The first frame whose given pose is not where its features are.
  void checkGiven(Frame& frame) {
    constexpr std::size_t kFewest = 20;    // features,
    constexpr double kDisagreement = 0.3;  // of which so few agree with it,
    constexpr double kShift = 0.1;         // metres
    constexpr double kTurn = M_PI / 36.0;  // radians
    const Odometry& odometry = locator_->odometry();
    if (contradicted_ || !odometry.started()) return;
    const PosePrior prior{*frame.given_pose, Matrix6::Identity(), true};
    const OdometryResult given = odometry.locate(frame.key_features, prior);
    if (given.matches < kFewest ||
        static_cast<double>(given.inliers) > kDisagreement * static_cast<double>(given.matches)) {
      return;
    }
    const OdometryResult seen = odometry.locate(frame.key_features);
    if (!seen.registered || seen.inliers < std::max(kFewest, 2 * given.inliers)) return;
    const Pose apart = frame.given_pose->inverse() * seen.T_world_sensor;
    const double turn = Eigen::AngleAxisd(Matrix3(apart.linear())).angle();
    if (apart.translation().norm() < kShift && turn < kTurn) return;
    contradicted_ = true;
    const auto rounded = [](double value) { return formatNumber(std::round(1e2 * value) / 1e2); };
    frame.warnings.push_back(
        "frame " + std::to_string(frame.number) + " " + frame.source +
        ": its given pose contradicts the images: " + std::to_string(seen.inliers) + " of " +
        std::to_string(seen.matches) + " known features put it " +
        rounded(apart.translation().norm()) + " m and " + rounded(turn * 180.0 / M_PI) +
        " degrees elsewhere; are images, depths, poses and calibration of one camera, in one "
        "order?");
  }

  void takeGiven(Frame& frame) {
    frame.T_world_sensor = *frame.given_pose;
    if (locator_->lastPose()) {
      frame.motion = motionTo(frame.T_world_sensor, 2.0 * poseCovariance(given_position_error_,
                                                                         given_orientation_error_));
    }
    locator_->setLastPose(frame.T_world_sensor);
  }

  void registerFrame(Frame& frame, bool given) {
    locator_->lookAt(frame);
    Odometry& odometry = locator_->odometry();
    std::optional<PosePrior> prior;
    if (given) {
      prior = PosePrior{*frame.given_pose,
                        poseCovariance(given_position_error_, given_orientation_error_),
                        poses_ == Poses::Use};
      checkGiven(frame);
    } else if (!odometry.started()) {
      if (locator_->lastPose()) {
        frame.skip_reason = "no pose is given and nothing was seen before to find one by";
        return;
      }
      prior = start(frame);
    } else {
      const auto placement = locator_->place(frame);
      if (!placement) {
        locator_->leaveOut();
        odometry.update({});
        frame.skip_reason = locator_->doubt();
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
    if (result.keyframe) locator_->remember(frame);
    if (given && poses_ == Poses::Use) {
      takeGiven(frame);
      return;
    }
    frame.motion = result.motion;
    if (out_of_order_ && frame.motion && locator_->lastPose()) {
      frame.motion->T_now_before = frame.T_world_sensor.inverse() * *locator_->lastPose();
      out_of_order_ = false;
    }
    locator_->setLastPose(frame.T_world_sensor);
    if (given && result.from_prior && !result.reason.empty()) {
      frame.notes.push_back(frame.source + ": given pose taken as it is: " + result.reason);
    }
    if (result.jump) {
      frame.notes.push_back(frame.source + ": a jump of " +
                            formatNumber(std::round(1e3 * jumpOf(*result.motion)) / 1e3) +
                            " m, found by known features");
    }
  }

  /// The first pose. A cloud to go by does not need features.
  std::optional<PosePrior> start(Frame& frame) {
    Odometry& odometry = locator_->odometry();
    odometry.setStart(start_.of(frame, optical_, noise_.optionalNoise()));
    if (!locator_->usesClouds() || !frame.cloud || frame.cloud->empty()) return std::nullopt;
    PosePrior prior;
    prior.T_world_sensor = odometry.expectedPose();
    prior.exact = true;
    return prior;
  }

  static double jumpOf(const FrameMotion& motion) {
    return motion.T_now_before.translation().norm();
  }

  bool optical_ = true;
  std::optional<detail::FrameLocator> locator_;
  bool out_of_order_ = false;  ///< the last frame with a pose was one placed again
  bool contradicted_ = false;  ///< a given pose, which is said once
};

std::string MotionEstimationStage::saveState() const {
  detail::StateWriter writer;
  writer(out_of_order_, contradicted_, locator_.has_value());
  if (locator_) {
    writer(params_.camera, surface_params_.cell, surface_params_.reach, locator_->usesClouds(),
           locator_->saveState());
  }
  return writer.take();
}

void MotionEstimationStage::loadState(const std::string& bytes) {
  detail::StateReader reader(bytes);
  bool is_prepared = false;
  reader(out_of_order_, contradicted_, is_prepared);
  if (is_prepared) {
    bool with_clouds = false;
    std::string locator;
    reader(params_.camera, surface_params_.cell, surface_params_.reach, with_clouds, locator);
    begin(with_clouds);
    locator_->loadState(locator);
  }
  reader.finish();
}

}  // namespace

namespace detail {

void addMotionEstimation(StageTable& table) {
  table.add<MotionEstimationStage>();
}

}  // namespace detail
}  // namespace planar_mapping
