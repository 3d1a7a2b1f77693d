// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <string>

#include "builtin.h"
#include "motion_keys.h"
#include "planar_mapping/core/base/detail/state_archive.h"
#include "planar_mapping/core/odometry/odometry.h"
#include "planar_mapping/core/registration/detail/surface_map.h"
#ifdef PLANAR_MAPPING_HAS_STEREO
#include "planar_mapping/stereo/detail/view_map.h"
#endif

namespace planar_mapping {
namespace {

using Poses = detail::MotionKeys::Poses;
using Clouds = detail::MotionKeys::Clouds;

Matrix6 poseCovariance(double position_error, double orientation_error) {
  Vector6 variance;
  variance << Vector3::Constant(position_error * position_error),
      Vector3::Constant(orientation_error * orientation_error);
  return Matrix6(variance.asDiagonal());
}

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
    if (!odometry_) prepare(frame);
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
    odometry_.emplace(params_);
#ifdef PLANAR_MAPPING_HAS_STEREO
    ViewMapParams view_params;
    view_params.camera = params_.camera;
    view_params.seed = params_.seed;
    views_.emplace(view_params);
#endif
    if (!with_clouds) return;
    surface_params_.optical_axis = optical_ ? Vector3::UnitZ() : Vector3(Vector3::Zero());
    surfaces_.emplace(surface_params_);
  }

  void lookAt(const Frame& frame) {
#ifdef PLANAR_MAPPING_HAS_STEREO
    const bool seen = frame.camera && !frame.images.left.empty() &&
                      static_cast<int>(frame.cloud->width) == frame.images.left.width &&
                      static_cast<int>(frame.cloud->height) == frame.images.left.height;
    view_ = seen ? views_->see(frame.images.left, viewOf(*frame.cloud), *frame.camera) : nullptr;
#endif
  }

  /// Makes the frame one that later ones are compared with.
  void remember(const Frame& frame) {
    if (surfaces_ && frame.cloud) surfaces_->insert(viewOf(*frame.cloud), frame.T_world_sensor);
#ifdef PLANAR_MAPPING_HAS_STEREO
    if (view_) views_->insert(view_, frame.T_world_sensor);
#endif
  }

  /// A frame that was left out, against what has been seen since. It is no step of the odometry.
  void placeAgain(Frame& frame) {
    frame.skip_reason = "it was left out before";
    if (!T_sensor_world_) return;
    lookAt(frame);
    doubt_.clear();
    const OdometryResult by_features = odometry_->locate(frame.key_features);
    std::optional<Pose> placed;
    if (by_features.registered && by_features.inliers >= static_cast<std::size_t>(enough_inliers_))
      placed = by_features.T_world_sensor;
#ifdef PLANAR_MAPPING_HAS_STEREO
    if (!view_ || views_->empty()) return;
    if (placed && views_->judge(view_, *placed, nullptr, true) != PoseVerdict::Confirmed)
      placed.reset();
    if (!placed) {
      const ViewMap::Location far =
          views_->locate(view_, T_sensor_world_->inverse(), {}, ViewGuess::Nothing);
      if (far.found) placed = far.T_world_sensor;
    }
#endif
    if (!placed) return;
    frame.skip_reason.clear();
    FrameMotion motion;
    motion.T_now_before = placed->inverse() * T_sensor_world_->inverse();
    motion.covariance = 2.0 * kByViews;
    frame.motion = motion;
    frame.T_world_sensor = *placed;
    remember(frame);
    T_sensor_world_ = placed->inverse();
    out_of_order_ = true;
  }

  /// The first frame whose given pose is not where its features are.
  void checkGiven(Frame& frame) {
    constexpr std::size_t kFewest = 20;    // features,
    constexpr double kDisagreement = 0.3;  // of which so few agree with it,
    constexpr double kShift = 0.1;         // metres
    constexpr double kTurn = M_PI / 36.0;  // radians
    if (contradicted_ || !odometry_->started()) return;
    const PosePrior prior{*frame.given_pose, Matrix6::Identity(), true};
    const OdometryResult given = odometry_->locate(frame.key_features, prior);
    if (given.matches < kFewest ||
        static_cast<double>(given.inliers) > kDisagreement * static_cast<double>(given.matches)) {
      return;
    }
    const OdometryResult seen = odometry_->locate(frame.key_features);
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
    if (T_sensor_world_) {
      FrameMotion motion;
      motion.T_now_before = frame.T_world_sensor.inverse() * T_sensor_world_->inverse();
      motion.covariance = 2.0 * poseCovariance(given_position_error_, given_orientation_error_);
      frame.motion = motion;
    }
    T_sensor_world_ = frame.T_world_sensor.inverse();
  }

  void registerFrame(Frame& frame, bool given) {
    cloud_reason_.clear();
    lookAt(frame);
    std::optional<PosePrior> prior;
    if (given) {
      prior = PosePrior{*frame.given_pose,
                        poseCovariance(given_position_error_, given_orientation_error_),
                        poses_ == Poses::Use};
      checkGiven(frame);
    } else if (!odometry_->started()) {
      if (T_sensor_world_) {
        frame.skip_reason = "no pose is given and nothing was seen before to find one by";
        return;
      }
      prior = start(frame);
    } else {
      const std::optional<Placement> placement = place(frame);
      if (!placement) {
        ++lost_;
        odometry_->update({});
        frame.skip_reason = doubt_;
        return;
      }
      prior = placement->prior;
    }
    const OdometryResult result = odometry_->update(frame.key_features, prior);
    frame.matches = result.matches;
    frame.inliers = result.inliers;
    frame.statistics.push_back({"motion_rms_px", result.registered ? result.rms_px : 0.0});
    if (!result.registered) {
      ++lost_;
      frame.skip_reason = reasonFor(frame, result);
      return;
    }
    lost_ = 0;
    by_cloud_ = result.from_prior;
    frame.T_world_sensor = result.T_world_sensor;
    if (result.keyframe) remember(frame);
    if (given && poses_ == Poses::Use) {
      takeGiven(frame);
      return;
    }
    frame.motion = result.motion;
    if (out_of_order_ && frame.motion && T_sensor_world_) {
      frame.motion->T_now_before = frame.T_world_sensor.inverse() * T_sensor_world_->inverse();
      out_of_order_ = false;
    }
    T_sensor_world_ = frame.T_world_sensor.inverse();
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
    odometry_->setStart(start_.of(frame, optical_, noise_.optionalNoise()));
    if (!surfaces_ || !frame.cloud || frame.cloud->empty()) return std::nullopt;
    PosePrior prior;
    prior.T_world_sensor = odometry_->expectedPose();
    prior.exact = true;
    return prior;
  }

  /// Where the frame is, if the views agree that it is there: by its features, its cloud, or
  /// earlier views. Nothing: it is left out.
  struct Placement {
    std::optional<PosePrior> prior;  ///< what the features are helped by
  };
  std::optional<Placement> place(const Frame& frame) {
    doubt_.clear();
    const OdometryResult by_features = odometry_->locate(frame.key_features);
    const Pose expected = expectedPose();
    const bool enough = by_features.inliers >= static_cast<std::size_t>(enough_inliers_);
    const bool many = by_features.inliers >= static_cast<std::size_t>(params_.jump_inliers);
    const bool features_agree =
        by_features.registered && agrees(by_features.T_world_sensor, expected, many);
    if (features_agree && enough) return Placement{};
    const Pose guess = features_agree ? by_features.T_world_sensor : expected;
    std::vector<Pose> candidates;
    if (by_features.registered) candidates.push_back(by_features.T_world_sensor);
    if (surfaces_) {
      const CloudRegistration near = surfaces_->locateNear(viewOf(*frame.cloud), guess);
      noteCloud(near);
      if (near.found && isSearchedFor()) {
        candidates.push_back(near.T_world_sensor);
        std::optional<Placement> far = placeFar(frame, guess, candidates);
        // The search is coarse: what it confirms is where the cloud says.
        const bool same = far && far->prior && isCertain(near.covariance) &&
                          isNear(far->prior->T_world_sensor, near.T_world_sensor);
        return same ? helped(frame, near.T_world_sensor, near.covariance, expected, false) : far;
      }
      if (near.found) {
        if (agrees(near.T_world_sensor, expected, false)) {
          return helped(frame, near.T_world_sensor, near.covariance, expected, false);
        }
#ifdef PLANAR_MAPPING_HAS_STEREO
        const std::optional<Pose> refined = views_->refined(view_, near.T_world_sensor);
        if (refined && agrees(*refined, expected, false)) {
          return helped(frame, *refined, kByViews, expected, true);
        }
        candidates.push_back(refined.value_or(near.T_world_sensor));
#endif
      }
    }
    if (features_agree) return Placement{};
    return placeFar(frame, guess, candidates);
  }

  bool isCertain(const Matrix6& covariance) const {
    const MotionParams& most = params_.motion;
    return std::sqrt(covariance.diagonal().head<3>().maxCoeff()) <= most.max_translation_error &&
           std::sqrt(covariance.diagonal().tail<3>().maxCoeff()) <= most.max_rotation_error;
  }

  /// Where no image tells whether a cloud fits, it is begun with where the camera was: the motion
  /// before, if a cloud alone gave it, is no better.
  Pose expectedPose() const {
#ifdef PLANAR_MAPPING_HAS_STEREO
    if (view_) return odometry_->expectedPose();
#endif
    return by_cloud_ && T_sensor_world_ ? T_sensor_world_->inverse() : odometry_->expectedPose();
  }

  static bool isNear(const Pose& a, const Pose& b) {
    constexpr double kDistance = 0.15;  // metres
    constexpr double kTurn = 0.1;       // radians
    const Vector6 apart = motionDifference(a, b);
    return (a.translation() - b.translation()).norm() < kDistance && apart.tail<3>().norm() < kTurn;
  }

  /// Nobody knows how far the camera has moved: where things repeat the next place that fits is no
  /// better than others.
  bool isSearchedFor() const {
#ifdef PLANAR_MAPPING_HAS_STEREO
    return view_ && !views_->empty() && !odometry_->hasVelocity();
#else
    return false;
#endif
  }

  std::optional<Placement> placeFar(const Frame& frame, const Pose& guess,
                                    std::vector<Pose> candidates) {
#ifdef PLANAR_MAPPING_HAS_STEREO
    if (view_ && !views_->empty()) {
      if (surfaces_) {
        for (const CloudRegistration& one : surfaces_->placesFar(viewOf(*frame.cloud), guess)) {
          if (one.matched > 0) candidates.push_back(one.T_world_sensor);
        }
      }
      const ViewMap::Location far = views_->locate(
          view_, guess, candidates,
          lost_ > kFewLost ? ViewGuess::Nothing
                           : (odometry_->hasVelocity() ? ViewGuess::Motion : ViewGuess::Place));
      if (far.found) {
        return helped(frame, far.T_world_sensor, kByViews, far.T_world_sensor, true);
      }
      doubt_ = far.reason;
      return std::nullopt;
    }
#endif
    if (!surfaces_) return Placement{};
    const CloudRegistration far = surfaces_->locate(viewOf(*frame.cloud), guess);
    return far.found ? helped(frame, far.T_world_sensor, far.covariance, far.T_world_sensor, false)
                     : Placement{};
  }

  /// A pose that the features may correct, unless the views object to what comes of it.
  Placement helped(const Frame& frame, const Pose& T_world_sensor, const Matrix6& covariance,
                   const Pose& expected, bool by_views) {
    PosePrior prior;
    prior.T_world_sensor = T_world_sensor;
    prior.covariance = covariance;
    const OdometryResult both = odometry_->locate(frame.key_features, prior);
    // Beside wrong features the few right ones only pull it away.
    const bool few = both.inliers < static_cast<std::size_t>(params_.jump_inliers);
    prior.exact = (by_views && (few || !both.registered)) ||
                  (both.registered && !agrees(both.T_world_sensor, expected, false));
    return {prior};
  }

  /// Whether the views speak for a pose; where they cannot tell, whether it is near where it was
  /// expected. \param likely  the pose has good support of its own
  bool agrees(const Pose& T_world_sensor, const Pose& expected, bool likely) {
#ifdef PLANAR_MAPPING_HAS_STEREO
    if (!view_ || views_->empty()) return true;
    const PoseVerdict verdict =
        views_->judge(view_, T_world_sensor, odometry_->hasVelocity() ? &expected : nullptr,
                      lost_ > kFewLost && !likely);
    if (verdict == PoseVerdict::Confirmed) return true;
    if (verdict == PoseVerdict::Doubtful && likely) return true;
    if (verdict == PoseVerdict::Unknown) return likely || follows(T_world_sensor, expected);
    doubt_ = verdict == PoseVerdict::Ambiguous ? "it looks the same from another place"
                                               : "earlier views contradict the pose they give";
    return false;
#else
    return true;
#endif
  }

  /// Whether a pose is a small step from where it was expected, and the last frame had one.
  bool follows(const Pose& T_world_sensor, const Pose& expected) const {
    constexpr double kStep = 0.3;  // metres
    constexpr double kTurn = 0.3;  // radians
    const Vector6 apart = motionDifference(expected, T_world_sensor);
    return lost_ == 0 && (expected.translation() - T_world_sensor.translation()).norm() < kStep &&
           apart.tail<3>().norm() < kTurn;
  }

  void noteCloud(const CloudRegistration& by_cloud) {
    if (by_cloud.found) {
      cloud_reason_ = "the cloud does not fix the pose either";
    } else {
      cloud_reason_ = by_cloud.seen_through > surface_params_.max_seen_through
                          ? "where the cloud would fit it sees through what was seen there before"
                          : "the cloud does not lie on what was seen before";
    }
  }

  std::string reasonFor(const Frame& frame, const OdometryResult& result) const {
    std::string reason = result.reason;
    if (frame.key_features.empty()) {
      reason = surfaces_ ? "there are no key features"
                         : "no pose is given and there are no key features to find one by";
    }
    return cloud_reason_.empty() ? reason : reason + ", and " + cloud_reason_;
  }

  static double jumpOf(const FrameMotion& motion) {
    return motion.T_now_before.translation().norm();
  }

  bool optical_ = true;
  std::string cloud_reason_;
  std::optional<Odometry> odometry_;
  std::optional<SurfaceMap> surfaces_;
  bool by_cloud_ = false;      ///< the last frame with a pose was placed without its features
  bool out_of_order_ = false;  ///< the last frame with a pose was one placed again
  bool contradicted_ = false;  ///< a given pose, which is said once
  std::string doubt_;
  static constexpr int kFewLost = 1;  ///< frames: then the camera sees what it saw before them
  int lost_ = 0;                      ///< frames that were left out since the last one that was not
  const Matrix6 kByViews = poseCovariance(0.02, 0.01);  ///< of what views settle on
#ifdef PLANAR_MAPPING_HAS_STEREO
  std::optional<ViewMap> views_;
  ViewMap::ViewPtr view_;  ///< of this frame; null without an image
#endif
  std::optional<Pose> T_sensor_world_;  ///< of the last frame with a pose
};

std::string MotionEstimationStage::saveState() const {
  detail::StateWriter writer;
  writer(T_sensor_world_, by_cloud_, out_of_order_, contradicted_, lost_, odometry_.has_value());
  if (odometry_) {
    writer(params_.camera, surface_params_.cell, surface_params_.reach, surfaces_.has_value(),
           odometry_->saveState(), surfaces_ ? surfaces_->saveState() : std::string());
#ifdef PLANAR_MAPPING_HAS_STEREO
    writer(views_->saveState());
#endif
  }
  return writer.take();
}

void MotionEstimationStage::loadState(const std::string& bytes) {
  detail::StateReader reader(bytes);
  bool is_prepared = false;
  reader(T_sensor_world_, by_cloud_, out_of_order_, contradicted_, lost_, is_prepared);
  if (is_prepared) {
    bool with_clouds = false;
    std::string odometry;
    std::string surfaces;
    reader(params_.camera, surface_params_.cell, surface_params_.reach, with_clouds, odometry,
           surfaces);
    begin(with_clouds);
    odometry_->loadState(odometry);
    if (surfaces_) surfaces_->loadState(surfaces);
#ifdef PLANAR_MAPPING_HAS_STEREO
    std::string views;
    reader(views);
    views_->loadState(views);
#endif
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
