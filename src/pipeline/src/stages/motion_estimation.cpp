// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <optional>
#include <string>

#include "builtin.h"
#include "keys/noise_keys.h"
#include "motion/frame_locator.h"
#include "motion/given_pose.h"
#include "motion/start_pose.h"
#include "planar_mapping/core/base/detail/state_archive.h"
#include "planar_mapping/core/odometry/odometry.h"
#include "planar_mapping/core/registration/detail/surface_map.h"
#include "rounded.h"

namespace planar_mapping {
namespace {

constexpr double kReachInCells = 6.0;

/// Gives each frame its pose: the given one, or the one at which FrameLocator and the features
/// agree. A frame that cannot be placed gets the reason (Frame::skip_reason).
class MotionEstimationStage : public Stage {
 public:
  static constexpr const char* kName = "motion_estimation";
  static constexpr const char* kSummary =
      "finds the pose of the frame from its key features (the paper, Eq. 8) or takes a given one";
  static constexpr StageKind kKind = StageKind::Motion;

  void declare(ParameterTable& table) override;
  void configure(const RunSettings& settings) override {
    odometry_params_.seed = settings.seed;
    odometry_params_.camera.depth_error = depth_error_;
    odometry_params_.camera.depth_error_growth = depth_error_growth_;
    odometry_params_.validate();
    surface_params_.depth_error = depth_error_;
    surface_params_.depth_error_growth = depth_error_growth_;
    surface_params_.validate();
  }
  void adapt(const CloudScale& scale) override {
    noise_.adapt(scale);
    optical_ = scale.optical;
    surface_params_.optical_axis = optical_ ? Vector3::UnitZ() : Vector3(Vector3::Zero());
  }
  void process(Frame& frame) override;
  std::string saveState() const override;
  void loadState(const std::string& bytes) override;

 private:
  enum class Poses : std::uint8_t { Use, Prior, Ignore };
  enum class Clouds : std::uint8_t { Auto, On, Off };

  void declareSearch(ParameterTable& table);
  void declareClouds(ParameterTable& table);
  void prepare(const Frame& frame);
  void startLocator(bool with_clouds);
  void placeAgain(Frame& frame);
  void takeGiven(Frame& frame);
  std::optional<detail::FrameLocator::Placement> placeDoubtful(const Frame& frame);
  void registerFrame(Frame& frame, bool given);
  std::optional<PosePrior> start(Frame& frame);
  FrameMotion motionTo(const Pose& T_world_sensor, const Matrix6& covariance) const;

  OdometryParams odometry_params_;
  Poses poses_ = Poses::Use;
  detail::StartPose start_;
  double given_position_error_ = 0.02;
  double given_orientation_error_ = 0.01;
  double depth_error_ = 0.003;
  double depth_error_growth_ = 0.002;
  detail::NoiseKeys noise_;
  Clouds clouds_ = Clouds::Auto;
  int enough_inliers_ = 60;
  SurfaceMapParams surface_params_;
  std::optional<double> cloud_cell_;
  std::optional<double> cloud_reach_;

  bool optical_ = true;  ///< clouds are in a camera's frame, z forward; else x forward, z up
  std::optional<detail::FrameLocator> locator_;
  bool out_of_order_ = false;  ///< the last frame with a pose was one placed again
  detail::GivenPoses given_;
};

void MotionEstimationStage::declare(ParameterTable& table) {
  table.word("poses", poses_,
             {{"use", Poses::Use}, {"prior", Poses::Prior}, {"ignore", Poses::Ignore}},
             "given poses are taken as they are, as a prior, or not at all; frames without one "
             "are registered by their features");
  start_.declare(table);
  table.number("given_position_error_m", given_position_error_, Range::positive(),
               "[ours] of given poses");
  table.number("given_orientation_error_deg", given_orientation_error_, Range::above(0.0, 180.0),
               "[ours] of given poses");
  table.number("pixel_error_px", odometry_params_.camera.pixel_error, Range::positive(),
               "[ours] of a feature's column and row");
  noise_.declareOptional(table, "depth error of the features by the stereo noise");
  table.number("depth_error_m", depth_error_, Range::atLeast(0.0),
               "[ours] without stereo noise: depth error near the camera");
  table.number("depth_error_growth", depth_error_growth_, Range::atLeast(0.0),
               "[ours] without stereo noise: depth error per square of depth, 1/m");
  declareSearch(table);
  declareClouds(table);
  table.basic({"poses", "start", "camera_height_m", "clouds"});
}

void MotionEstimationStage::declareSearch(ParameterTable& table) {
  MotionParams& motion = odometry_params_.motion;
  table.number("inlier_sigmas", motion.inlier_sigmas, Range::positive(),
               "[ours] a feature agrees within so many standard deviations of its noise");
  table.integer("min_matches", motion.min_matches, Range::atLeast(3),
                "[ours] known features a frame needs");
  table.integer("min_inliers", motion.min_inliers, Range::atLeast(3),
                "[ours] of those, how many must agree");
  table.number("min_inlier_fraction", motion.min_inlier_fraction, Range::between(0.0, 1.0),
               "[ours] of those, which fraction must agree");
  table.integer("max_iterations", motion.max_iterations, Range::atLeast(1),
                "[ours] minimal sets tried at most");
  table.number("max_position_error_m", motion.max_translation_error, Range::positive(),
               "[ours] a pose less certain is not used");
  table.number("max_orientation_error_deg", motion.max_rotation_error, Range::above(0.0, 180.0),
               "[ours] a pose less certain is not used");
  table.number("keyframe_translation", odometry_params_.keyframe_translation, Range::positive(),
               "[ours] new keyframe after this fraction of the median depth");
  table.number("keyframe_rotation_deg", odometry_params_.keyframe_rotation,
               Range::above(0.0, 180.0), "[ours] new keyframe after this turn");
  table.integer("max_landmarks", odometry_params_.max_landmarks, Range::atLeast(100),
                "[ours] kept for registration");
  table.number("jump_inlier_fraction", odometry_params_.jump_inlier_fraction,
               Range::between(0.0, 1.0),
               "[ours] fraction of known features that must agree on a jump, ...");
  table.integer("jump_inliers", odometry_params_.jump_inliers, Range::atLeast(0),
                "[ours] ... or so many of them, and a fifth");
  table.number("jump_distance_m", odometry_params_.jump_distance, Range::positive(),
               "[ours] a motion so far off the expected one is reported");
}

void MotionEstimationStage::declareClouds(ParameterTable& table) {
  table.word("clouds", clouds_, {{"auto", Clouds::Auto}, {"on", Clouds::On}, {"off", Clouds::Off}},
             "[ours] where features are too few, the cloud is registered to the surfaces seen "
             "before; auto = unless it is of a stereo pair");
  table.integer("enough_inliers", enough_inliers_, Range::atLeast(0),
                "[ours] with so many features that agree the cloud is not needed");
  table.number("cloud_cell_m", cloud_cell_, Range::positive(),
               "[ours] side of the cells of those surfaces; auto = 0.05, or the least multiple by "
               "2, 4, 8 or 16 with which half of the first cloud's points lie on planes of cells");
  table.number("cloud_reach_m", cloud_reach_, Range::positive(),
               "[ours] from how far a cloud is drawn to them; auto = 6 cells");
  table.number("cloud_search_reach_m", surface_params_.search_reach, Range::atLeast(0.0),
               "[ours] from how far, and turned anyhow, it is looked for where it is not found "
               "near; 0 = it is not");
  table.number("cloud_max_seen_through", surface_params_.max_seen_through, Range::between(0.0, 1.0),
               "[ours] fraction of the cells that may be seen through where the cloud is put");
  table.number("cloud_min_fraction", surface_params_.min_fraction, Range::between(0.0, 1.0),
               "[ours] of the cloud's cells that must lie on them");
}

void MotionEstimationStage::process(Frame& frame) {
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
  frame.statistics.push_back({"motion_step_m", frame.motion && frame.skip_reason.empty()
                                                   ? frame.motion->T_now_before.translation().norm()
                                                   : 0.0});
}

void MotionEstimationStage::prepare(const Frame& frame) {
  FeatureCamera& camera = odometry_params_.camera;
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
      surface_params_.cell = surfaceCellFor(pointsOf(*frame.cloud), surface_params_);
    }
    surface_params_.reach = cloud_reach_.value_or(kReachInCells * surface_params_.cell);
  }
  startLocator(with_clouds);
}

void MotionEstimationStage::startLocator(bool with_clouds) {
  locator_.emplace(odometry_params_, with_clouds ? &surface_params_ : nullptr, enough_inliers_);
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
  frame.motion = motionTo(*placed, 2.0 * detail::FrameLocator::covarianceByViews());
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
  if (locator_->lastPose()) {
    frame.motion =
        motionTo(frame.T_world_sensor,
                 2.0 * detail::poseCovariance(given_position_error_, given_orientation_error_));
  }
  locator_->setLastPose(frame.T_world_sensor);
}

/// Of a frame whose image may not be registered to its cloud: as if there were none, else near.
/// After a frame that was left out nobody knows how far the camera has moved: then a cloud alone
/// tells too little where things repeat.
std::optional<detail::FrameLocator::Placement> MotionEstimationStage::placeDoubtful(
    const Frame& frame) {
  if (!locator_->isLost()) {
    Frame bare = frame;
    bare.images.left = io::Image();
    bare.key_features.clear();
    locator_->lookAt(bare);
    std::optional<detail::FrameLocator::Placement> by_cloud = locator_->place(bare);
    locator_->lookAt(frame);
    if (by_cloud && by_cloud->prior &&
        !locator_->isBetterByFeatures(frame, by_cloud->prior->T_world_sensor)) {
      by_cloud->prior->exact = true;
      return by_cloud;
    }
  }
  std::optional<detail::FrameLocator::Placement> by_image = locator_->place(frame);
  if (by_image && by_image->prior && !locator_->isStep(by_image->prior->T_world_sensor))
    by_image.reset();
  return by_image;
}

void MotionEstimationStage::registerFrame(Frame& frame, bool given) {
  locator_->lookAt(frame);
  Odometry& odometry = locator_->odometry();
  std::optional<PosePrior> prior;
  if (given) {
    prior = PosePrior{*frame.given_pose,
                      detail::poseCovariance(given_position_error_, given_orientation_error_),
                      poses_ == Poses::Use, true};
    if (const auto warning = given_.contradictionOf(frame, odometry, locator_->lastPose()))
      frame.warnings.push_back(*warning);
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
      frame.skip_reason = frame.image_doubtful ? "its colour image does not seem to be registered "
                                                 "to its depth, and depth alone does "
                                                 "not tell where it is"
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
                          detail::rounded(result.motion->T_now_before.translation().norm(), 3) +
                          " m, found by known features");
  }
}

/// The first pose. A cloud to go by does not need features, nor does a frame that none follows.
std::optional<PosePrior> MotionEstimationStage::start(Frame& frame) {
  Odometry& odometry = locator_->odometry();
  odometry.setStart(start_.of(frame, optical_, noise_.optionalNoise()));
  frame.starts_world = !frame.given_pose || !start_.isGiven();
  const bool has_cloud = locator_->usesClouds() && frame.cloud && !frame.cloud->empty();
  if (!has_cloud && !frame.is_only) return std::nullopt;
  PosePrior prior;
  prior.T_world_sensor = odometry.expectedPose();
  prior.exact = true;
  return prior;
}

std::string MotionEstimationStage::saveState() const {
  detail::StateWriter writer;
  writer(out_of_order_, given_.contradicted, given_.agreed, locator_.has_value());
  if (locator_) {
    writer(odometry_params_.camera, surface_params_.cell, surface_params_.reach,
           locator_->usesClouds(), locator_->saveState());
  }
  return writer.take();
}

void MotionEstimationStage::loadState(const std::string& bytes) {
  detail::StateReader reader(bytes);
  bool is_prepared = false;
  reader(out_of_order_, given_.contradicted, given_.agreed, is_prepared);
  if (is_prepared) {
    bool with_clouds = false;
    std::string locator;
    reader(odometry_params_.camera, surface_params_.cell, surface_params_.reach, with_clouds,
           locator);
    startLocator(with_clouds);
    locator_->loadState(locator);
  }
  reader.finish();
}

}  // namespace

void detail::addMotionEstimation(StageTable& table) {
  table.add<MotionEstimationStage>();
}

}  // namespace planar_mapping
