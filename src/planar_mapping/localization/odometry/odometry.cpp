// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/odometry/odometry.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/localization/odometry/frame_features.h"
#include "planar_mapping/localization/odometry/local_map.h"
#include "planar_mapping/localization/odometry/motion_refinement.h"

namespace planar_mapping {
namespace {

using detail::SeenFeature;

/// See locateMatches().
constexpr int kMinWithPrior = 6;

/// Covariance of how far the map as a whole may be off beside that of an independent pose.
constexpr double kDrift = 0.1;

/// Covariance of a motion a after a motion b.
Matrix6 composed(const Matrix6& of_a, const Pose& a, const Matrix6& of_b) {
  const Matrix6 A = adjoint(a);
  return of_a + A * of_b * A.transpose();
}

}  // namespace

void OdometryParams::validate() const {
  constexpr double kLargest = std::numeric_limits<double>::max();
  camera.validate();
  motion.validate();
  requirePositive("keyframe_translation", keyframe_translation);
  requirePositive("keyframe_rotation", keyframe_rotation, "rad");
  requireInRange("max_landmarks", max_landmarks, 100, kLargest);
  requirePositive("jump_distance", jump_distance, "m");
  requireInRange("jump_inlier_fraction", jump_inlier_fraction, 0.0, 1.0);
  requireInRange("jump_inliers", jump_inliers, 0, kLargest);
}

class Odometry::Implementation {
 public:
  explicit Implementation(const OdometryParams& params) : params_(params), map_(params) {
    params.validate();
  }

  OdometryResult update(const std::vector<KeyFeature>& features,
                        const std::optional<PosePrior>& prior) {
    OdometryResult result;
    result.is_inlier.assign(features.size(), 0);
    const std::vector<SeenFeature> seen = detail::usableFeatures(features, params_.camera);
    result.features = seen.size();
    ++frame_;
    if (!started_) {
      start(seen, prior, result);
    } else {
      follow(seen, prior, result);
    }
    return result;
  }

  OdometryResult locate(const std::vector<KeyFeature>& features,
                        const std::optional<PosePrior>& prior) const {
    OdometryResult result;
    const std::vector<SeenFeature> seen = detail::usableFeatures(features, params_.camera);
    result.features = seen.size();
    std::vector<std::size_t> match_seen;
    const std::vector<FeatureMatch> matches = matchesOf(seen, match_seen);
    result.matches = matches.size();
    const MotionEstimate estimate = locateMatches(matches, prior, frame_ + 1);
    result.inliers = estimate.inliers;
    result.rms_px = estimate.rms_px;
    result.registered = started_ && isBelieved(estimate, matches.size(), prior);
    if (result.registered) {
      result.T_world_sensor = estimate.T_now_before.inverse();
    } else {
      result.reason = detail::reasonFor(estimate, seen.size(), matches.size(), params_.motion);
    }
    return result;
  }

  Pose expectedPose() const { return has_pose_ ? Pose(expected().inverse()) : start_; }

  bool hasVelocity() const { return has_velocity_ && lost_frames_ == 0; }

  const OdometryParams& params() const { return params_; }
  const detail::LocalMap& map() const { return map_; }
  bool started() const { return started_; }
  void setStart(const Pose& pose) { start_ = pose; }

 private:
  void start(const std::vector<SeenFeature>& seen, const std::optional<PosePrior>& prior,
             OdometryResult& result) {
    const bool given = prior && prior->exact;
    if (!given && seen.size() < static_cast<std::size_t>(params_.motion.min_matches)) {
      result.reason = "only " + detail::counted(seen.size(), "feature") + " to start from, " +
                      std::to_string(params_.motion.min_matches) + " are needed";
      return;
    }
    const Pose T_world_sensor = prior ? prior->T_world_sensor : start_;
    started_ = true;
    result.registered = true;
    result.from_prior = prior.has_value();
    accept(T_world_sensor.inverse(), Matrix6::Zero(), seen, result);
  }

  void follow(const std::vector<SeenFeature>& seen, const std::optional<PosePrior>& prior,
              OdometryResult& result) {
    std::vector<std::size_t> match_seen;
    const std::vector<FeatureMatch> matches = matchesOf(seen, match_seen);
    result.matches = matches.size();
    const MotionEstimate estimate = locateMatches(matches, prior, frame_);
    result.inliers = estimate.inliers;
    result.rms_px = estimate.rms_px;
    if (!isBelieved(estimate, matches.size(), prior)) {
      result.reason = detail::reasonFor(estimate, seen.size(), matches.size(), params_.motion);
      if (!prior || !params_.motion.isCertain(prior->covariance)) {
        ++lost_frames_;
        return;
      }
      result.from_prior = true;
    }
    result.registered = true;
    if (result.from_prior) {
      const std::vector<SeenFeature> used = acceptedMatches(
          seen, match_seen, agreementWith(matches, prior->T_world_sensor.inverse()), result);
      accept(prior->T_world_sensor.inverse(), prior->covariance, used, result);
    } else {
      const std::vector<SeenFeature> used = acceptedMatches(seen, match_seen, estimate, result);
      Pose T_sensor_world = estimate.T_now_before;
      Matrix6 covariance = estimate.covariance;
      if (prior && prior->independent) {
        constexpr double kGain = kDrift / (1.0 + kDrift);
        const Vector6 drift = motionDifference(T_sensor_world, prior->T_world_sensor.inverse());
        T_sensor_world = motionStep(kGain * drift) * T_sensor_world;
        covariance += kGain * kDrift * prior->covariance;
      }
      accept(T_sensor_world, covariance, used, result);
    }
  }

  /// Features the map knows, and which they are.
  std::vector<FeatureMatch> matchesOf(const std::vector<SeenFeature>& seen,
                                      std::vector<std::size_t>& match_seen) const {
    std::vector<FeatureMatch> matches;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const detail::Landmark* landmark = map_.find(seen[i].track);
      FeatureMatch match;
      if (landmark == nullptr ||
          !detail::invertCovariance(landmark->information, match.covariance)) {
        continue;
      }
      match.before = landmark->position;
      match.now = seen[i].sighting;
      matches.push_back(match);
      match_seen.push_back(i);
    }
    return matches;
  }

  MotionEstimate locateMatches(const std::vector<FeatureMatch>& matches,
                               const std::optional<PosePrior>& prior, std::int64_t frame) const {
    Random random(params_.seed, static_cast<std::uint64_t>(frame));
    if (prior && prior->exact) return agreementWith(matches, prior->T_world_sensor.inverse());
    std::optional<MotionPrior> motion_prior;
    if (prior) {
      const double drift = prior->independent ? kDrift : 0.0;
      motion_prior =
          MotionPrior{prior->T_world_sensor.inverse(), (1.0 + drift) * prior->covariance};
    }
    // A prior makes up for features: the few that agree hold what it leaves open.
    MotionParams motion_params = params_.motion;
    if (prior) motion_params.min_inliers = std::min(motion_params.min_inliers, kMinWithPrior);
    const Pose guess = expected();
    return estimateMotion(matches, params_.camera, motion_params, random, &guess, motion_prior);
  }

  /// See OdometryParams::jump_distance. A prior tells more than what was expected.
  bool isBelieved(const MotionEstimate& estimate, std::size_t matches,
                  const std::optional<PosePrior>& prior) const {
    if (!estimate.found()) return false;
    const Pose guess = prior ? prior->T_world_sensor.inverse() : expected();
    const double surprise =
        (estimate.T_now_before.inverse().translation() - guess.inverse().translation()).norm();
    constexpr double kMinFraction = 0.2;  // of many that agree: the others may have stayed
    const auto inliers = static_cast<double>(estimate.inliers);
    const auto known = static_cast<double>(matches);
    return surprise <= params_.jump_distance || inliers >= params_.jump_inlier_fraction * known ||
           (estimate.inliers >= static_cast<std::size_t>(params_.jump_inliers) &&
            inliers >= kMinFraction * known);
  }

  /// Constant velocity, for as long as that is likely to hold.
  Pose expected() const {
    constexpr int kLongestExtrapolation = 3;
    Pose pose = T_sensor_world_;
    if (lost_frames_ > kLongestExtrapolation) return pose;
    for (int i = 0; i <= lost_frames_; ++i) pose = velocity_ * pose;
    return pose;
  }

  /// Which matches agree with a pose that is known.
  MotionEstimate agreementWith(const std::vector<FeatureMatch>& matches, const Pose& pose) const {
    MotionEstimate result;
    result.status = MotionStatus::Found;
    result.T_now_before = pose;
    result.is_inlier.assign(matches.size(), 0);
    const double limit = params_.motion.inlier_sigmas * params_.motion.inlier_sigmas;
    double squared_pixels = 0.0;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      if (!(detail::squaredError(matches[i], params_.camera, pose) <= limit)) continue;
      result.is_inlier[i] = 1;
      ++result.inliers;
      const FeatureSighting s = project(params_.camera, pose * matches[i].before);
      squared_pixels +=
          std::pow(s.column - matches[i].now.column, 2) + std::pow(s.row - matches[i].now.row, 2);
    }
    if (result.inliers > 0) {
      result.rms_px = std::sqrt(squared_pixels / static_cast<double>(result.inliers));
    }
    return result;
  }

  /// Features of the frame that may enter the map: new ones and those that agree with it. A
  /// landmark that is contradicted time and again is forgotten: its track has slipped.
  std::vector<SeenFeature> acceptedMatches(const std::vector<SeenFeature>& seen,
                                           const std::vector<std::size_t>& match_seen,
                                           const MotionEstimate& estimate, OdometryResult& result) {
    constexpr int kDisagreements = 3;
    std::vector<std::uint8_t> contradicts(seen.size(), 0);
    for (std::size_t m = 0; m < match_seen.size(); ++m) {
      const SeenFeature& one = seen[match_seen[m]];
      detail::Landmark* landmark = map_.find(one.track);
      if (estimate.is_inlier[m] != 0) {
        landmark->disagreements = 0;
        result.is_inlier[one.feature] = 1;
      } else if (++landmark->disagreements >= kDisagreements) {
        map_.remove(one.track);
      } else {
        contradicts[match_seen[m]] = 1;
      }
    }
    std::vector<SeenFeature> used;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (contradicts[i] == 0) used.push_back(seen[i]);
    }
    return used;
  }

  /// The pose stands: the frame goes into the map.
  void accept(const Pose& T_sensor_world, const Matrix6& covariance,
              const std::vector<SeenFeature>& used, OdometryResult& result) {
    map_.removePassing();
    std::vector<detail::TrackSighting> sightings;
    sightings.reserve(used.size());
    for (const SeenFeature& one : used) sightings.push_back({one.track, one.sighting});
    result.keyframe = needsKeyframe(T_sensor_world, used, result);
    map_.add(T_sensor_world, sightings, frame_, result.keyframe);
    if (result.keyframe) {
      T_keyframe_world_ = T_sensor_world;
      most_inliers_ = 0;
    } else {
      most_inliers_ = std::max(most_inliers_, result.inliers);
    }
    finish(T_sensor_world, covariance, result);
  }

  void finish(const Pose& T_sensor_world, const Matrix6& covariance, OdometryResult& result) {
    result.T_world_sensor = T_sensor_world.inverse();
    if (has_pose_) {
      FrameMotion motion;
      motion.T_now_before = T_sensor_world * T_sensor_world_.inverse();
      // As if the two poses were independent: not less than the truth.
      motion.covariance = composed(covariance, motion.T_now_before, covariance_);
      const bool follows = lost_frames_ == 0;
      if (has_velocity_ && follows) {
        motion.predicted = velocity_;
        const Vector3 surprise = (motion.T_now_before * velocity_.inverse()).translation();
        result.jump = surprise.norm() > params_.jump_distance;
      }
      has_velocity_ = follows && !result.jump;
      velocity_ = has_velocity_ ? motion.T_now_before : Pose(Pose::Identity());
      result.motion = motion;
    }
    lost_frames_ = 0;
    has_pose_ = true;
    T_sensor_world_ = T_sensor_world;
    covariance_ = covariance;
  }

  bool needsKeyframe(const Pose& T_sensor_world, const std::vector<SeenFeature>& used,
                     const OdometryResult& result) const {
    constexpr double kKeyframeOverlap = 0.7;  // of what the last keyframe sees
    if (!has_pose_ || result.from_prior) return true;
    const Pose moved = T_sensor_world * T_keyframe_world_.inverse();
    if (rotationAngle(moved.linear()) > params_.keyframe_rotation) return true;
    const auto known = static_cast<double>(result.inliers);
    if (known < kKeyframeOverlap * static_cast<double>(most_inliers_)) return true;
    if (used.empty()) return false;
    std::vector<double> inverse_depth;
    for (const SeenFeature& one : used) inverse_depth.push_back(one.sighting.inverse_depth);
    const double median = detail::ranked(inverse_depth, used.size() / 2);
    return moved.translation().norm() * median > params_.keyframe_translation;
  }

  OdometryParams params_;
  detail::LocalMap map_;
  Pose start_ = Pose::Identity();
  bool started_ = false;
  std::int64_t frame_ = 0;
  bool has_pose_ = false;
  Pose T_keyframe_world_ = Pose::Identity();  ///< of the last keyframe
  Pose T_sensor_world_ = Pose::Identity();    ///< of the last frame that was registered
  Matrix6 covariance_ = Matrix6::Zero();
  Pose velocity_ = Pose::Identity();  ///< motion of the last frame
  bool has_velocity_ = false;
  int lost_frames_ = 0;           ///< since the last one that was registered
  std::size_t most_inliers_ = 0;  ///< of a frame since the last keyframe
};

Odometry::Odometry(const OdometryParams& params)
    : implementation_(std::make_unique<Implementation>(params)) {}
Odometry::~Odometry() = default;
Odometry::Odometry(const Odometry& other)
    : implementation_(std::make_unique<Implementation>(*other.implementation_)) {}
Odometry& Odometry::operator=(const Odometry& other) {
  return *this = Odometry(other);
}
Odometry::Odometry(Odometry&&) noexcept = default;
Odometry& Odometry::operator=(Odometry&&) noexcept = default;

const OdometryParams& Odometry::params() const {
  return implementation_->params();
}

void Odometry::setStart(const Pose& T_world_sensor) {
  requireRigid("the start pose", T_world_sensor);
  implementation_->setStart(T_world_sensor);
}

OdometryResult Odometry::update(const std::vector<KeyFeature>& features,
                                const std::optional<PosePrior>& prior) {
  detail::requireTracks(features);
  if (prior) requireRigid("the pose given for a frame", prior->T_world_sensor);
  if (prior && !prior->exact && !prior->covariance.allFinite())
    throw InputError("the covariance of the pose given for a frame is not finite");
  return implementation_->update(features, prior);
}

Pose Odometry::expectedPose() const {
  return implementation_->expectedPose();
}
bool Odometry::hasVelocity() const {
  return implementation_->hasVelocity();
}
OdometryResult Odometry::locate(const std::vector<KeyFeature>& features,
                                const std::optional<PosePrior>& prior) const {
  detail::requireTracks(features);
  return implementation_->locate(features, prior);
}

bool Odometry::started() const {
  return implementation_->started();
}
std::size_t Odometry::landmarks() const {
  return implementation_->map().landmarks();
}
std::optional<Vector3> Odometry::landmark(std::int64_t track) const {
  const detail::Landmark* found = implementation_->map().find(track);
  return found == nullptr ? std::nullopt : std::optional<Vector3>(found->position);
}

}  // namespace planar_mapping
