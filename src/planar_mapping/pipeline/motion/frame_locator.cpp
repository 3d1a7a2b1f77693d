// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/motion/frame_locator.h"

#include <algorithm>

#include "planar_mapping/pipeline/keyframe_view.h"

namespace planar_mapping::detail {
namespace {

// How far depth alone may place a frame from where it is expected.
constexpr double kStep = 1.0;         // metres
constexpr double kTurn = M_PI / 3.0;  // radians
constexpr const char* kLooksTheSame = "it looks the same from another place";
constexpr int kFewLost = 1;   // frames: then the camera sees what it saw before them
constexpr int kManyLost = 5;  // frames: then nobody knows where what spins has gone

/// Are two poses less than so many metres and radians apart?
bool isNear(const Pose& a, const Pose& b, double distance, double turn) {
  return (a.translation() - b.translation()).norm() < distance &&
         motionDifference(a, b).tail<3>().norm() < turn;
}

}  // namespace

Matrix6 poseCovariance(double position_error, double orientation_error) {
  Vector6 variance;
  variance << Vector3::Constant(position_error * position_error),
      Vector3::Constant(orientation_error * orientation_error);
  return Matrix6(variance.asDiagonal());
}

FrameLocator::FrameLocator(const OdometryParams& params, const SurfaceMapParams* surface,
                           int enough_inliers)
    : enough_inliers_(enough_inliers), odometry_(params) {
#ifdef PLANAR_MAPPING_HAS_STEREO
  startViews();
#endif
  if (surface != nullptr) surfaces_.emplace(*surface);
}

#ifdef PLANAR_MAPPING_HAS_STEREO
void FrameLocator::startViews() {
  ViewMapParams params;
  params.camera = odometry_.params().camera;
  params.seed = odometry_.params().seed;
  views_.emplace(params);
}
#endif

void FrameLocator::lookAt([[maybe_unused]] const Frame& frame) {
  doubt_.clear();
  cloud_reason_.clear();
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (frame.images_changed) startViews();
  view_ = showsItsCloud(frame)
              ? views_->see(frame.images.left, pointsOf(*frame.cloud), *frame.camera)
              : nullptr;
#endif
}

void FrameLocator::remember(const Frame& frame) {
  if (surfaces_ && frame.cloud) surfaces_->insert(pointsOf(*frame.cloud), frame.T_world_sensor);
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (view_) views_->insert(view_, frame.T_world_sensor);
#endif
}

void FrameLocator::accept(const OdometryResult& result) {
  lost_ = 0;
  by_cloud_ = result.from_prior;
}

/// A cloud that is no image and of no camera is taken for a scan all around; so is one of a sensor
/// without an optical axis, in whatever rows its driver writes it.
bool FrameLocator::isPartial(const Frame& frame) const {
  const bool spins = surfaces_ && surfaces_->params().optical_axis.isZero();
  return frame.cloud && (frame.camera || (frame.cloud->height > 1 && !spins));
}

bool FrameLocator::isSeen() const {
#ifdef PLANAR_MAPPING_HAS_STEREO
  return view_ && !views_->empty();
#else
  return false;
#endif
}

std::optional<Pose> FrameLocator::placeAgain(const Frame& frame) {
  const OdometryResult by_features = odometry_.locate(frame.key_features);
  std::optional<Pose> placed;
  if (by_features.registered && isEnough(by_features)) placed = by_features.T_world_sensor;
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (!isSeen()) return std::nullopt;
  if (placed && views_->check(view_, *placed, nullptr, true) != PoseVerdict::Confirmed)
    placed.reset();
  if (!placed) {
    const ViewMap::Location far = views_->locate(view_, *last_pose_, {}, ViewGuess::Nothing);
    if (far.found) placed = far.T_world_sensor;
  }
#endif
  return placed;
}

CloudRegistration FrameLocator::nearBy(const Frame& frame, const Pose& guess) const {
  return surfaces_ && frame.cloud ? surfaces_->locateNear(pointsOf(*frame.cloud), guess)
                                  : CloudRegistration();
}

std::optional<FrameLocator::Placement> FrameLocator::place(const Frame& frame) {
  const OdometryResult by_features = odometry_.locate(frame.key_features);
  const Pose expected = expectedPose(frame);
  const bool many =
      by_features.inliers >= static_cast<std::size_t>(odometry_.params().jump_inliers);
  const bool features_fit =
      by_features.registered && agrees(by_features.T_world_sensor, expected, many);
  std::optional<Pose> better;
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (features_fit) better = betterThan(by_features.T_world_sensor, expected, frame);
  if (better) {
    const std::optional<Pose> refined = views_->refined(view_, *better);
    if (refined && agrees(*refined, expected, false))
      return helped(frame, *refined, covarianceByViews(), expected, true);
  }
#endif
  const bool features_agree = features_fit && !better;
  if (features_agree && isEnough(by_features)) return Placement{};
  const int most = isPartial(frame) ? kFewLost : kManyLost;
  if (surfaces_ && lost_ > most && !by_features.registered && !isSeen()) {
    doubt_ = "too many frames before it were left out to find it by its cloud alone";
    return std::nullopt;
  }
  const Pose guess = features_agree ? by_features.T_world_sensor : expected;
  std::vector<PoseCandidate> candidates;
  if (by_features.registered) candidates.push_back({better.value_or(by_features.T_world_sensor)});
  if (surfaces_) {
    const CloudRegistration near = surfaces_->locateNear(pointsOf(*frame.cloud), guess, lost_);
    noteCloud(near);
    if (near.found && isSearchedFor()) {
      candidates.push_back(candidateOf(near));
      std::optional<Placement> far = placeFar(frame, guess, candidates);
      // The search is coarse: what it confirms is where the cloud says.
      const bool same = far && far->prior && odometry_.params().motion.isCertain(near.covariance) &&
                        isNear(far->prior->T_world_sensor, near.T_world_sensor, 0.15, 0.1);
      return same ? helped(frame, near.T_world_sensor, near.covariance, expected, false) : far;
    }
    if (near.found && isDoubtful(frame, near, expected)) {
      const CloudRegistration only =
          surfaces_->locateFar(pointsOf(*frame.cloud), guess, near, lost_);
      if (only.found && (lost_ <= kFewLost || isNear(guess, only.T_world_sensor, kStep, kTurn)))
        return helped(frame, only.T_world_sensor, only.covariance, expected, false);
      cloud_reason_ = "the cloud fits no place clearly better than others";
      return Placement{};
    }
    if (near.found) {
      if (agrees(near.T_world_sensor, expected, false))
        return helped(frame, near.T_world_sensor, near.covariance, expected, false);
#ifdef PLANAR_MAPPING_HAS_STEREO
      const std::optional<Pose> refined = views_->refined(view_, near.T_world_sensor);
      if (refined && agrees(*refined, expected, false))
        return helped(frame, *refined, covarianceByViews(), expected, true);
      candidates.push_back({refined.value_or(near.T_world_sensor)});
#endif
    }
  }
  if (!features_agree) return placeFar(frame, guess, candidates);
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (isSeen()) {
    // Few features, in a corner of the image, are right and yet no good pose.
    const std::optional<Pose> precise = views_->locateByFeatures(view_, guess);
    if (precise) return helped(frame, *precise, covarianceByViews(), *precise, true);
  }
#endif
  return Placement{};
}

#ifdef PLANAR_MAPPING_HAS_STEREO
/// A pose at which the depths agree far better than at that of the features: the expected one, or
/// where the cloud is drawn to.
std::optional<Pose> FrameLocator::betterThan(const Pose& by_features, const Pose& expected,
                                             const Frame& frame) const {
  if (!isSeen()) return std::nullopt;
  if (views_->fitsBetter(view_, expected, by_features)) return expected;
  if (!surfaces_ || !views_->fitsBadly(view_, by_features)) return std::nullopt;
  for (const Pose& start : {by_features, *last_pose_}) {
    const CloudRegistration drawn = surfaces_->locateNear(pointsOf(*frame.cloud), start);
    if (drawn.matched > 0 && views_->fitsBetter(view_, drawn.T_world_sensor, by_features))
      return drawn.T_world_sensor;
  }
  return std::nullopt;
}
#endif

bool FrameLocator::isBetterByFeatures([[maybe_unused]] const Frame& frame,
                                      [[maybe_unused]] const Pose& T_world_sensor) const {
#ifdef PLANAR_MAPPING_HAS_STEREO
  const OdometryResult by_features = odometry_.locate(frame.key_features);
  return by_features.registered && isEnough(by_features) && isSeen() &&
         views_->fitsBetter(view_, by_features.T_world_sensor, T_world_sensor);
#else
  return false;
#endif
}

bool FrameLocator::isAmbiguous([[maybe_unused]] const Pose& T_world_sensor) const {
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (!isSeen()) return false;
  const Pose expected = odometry_.expectedPose();
  const PoseVerdict verdict =
      views_->check(view_, T_world_sensor, odometry_.hasVelocity() ? &expected : nullptr, false);
  return verdict == PoseVerdict::Ambiguous || verdict == PoseVerdict::Doubtful;
#else
  return false;
#endif
}

/// Where no image tells whether a cloud fits, it is begun with where the camera was: the motion
/// before, if a cloud alone gave it, is no better. What spins is on a vehicle, which goes on.
Pose FrameLocator::expectedPose(const Frame& frame) const {
  if (!isPartial(frame)) return odometry_.expectedPose();
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (view_) return odometry_.expectedPose();
#endif
  return by_cloud_ && last_pose_ ? *last_pose_ : odometry_.expectedPose();
}

/// Whether no image tells if a cloud lies where it was drawn to: of a camera little of it does, a
/// scan is not where it was expected, to 0.3 m and 0.2 radians.
bool FrameLocator::isDoubtful(const Frame& frame, const CloudRegistration& near,
                              const Pose& expected) const {
  constexpr double kLittle = 0.5;  // it may lie better a little farther
  return !isSeen() && (isPartial(frame) ? near.fraction < kLittle
                                        : !isNear(expected, near.T_world_sensor, 0.3, 0.2));
}

bool FrameLocator::isStep(const Pose& T_world_sensor) const {
  return isNear(odometry_.expectedPose(), T_world_sensor, kStep, kTurn);
}

/// Nobody knows how far the camera has moved: where things repeat the next place that fits is no
/// better than others.
bool FrameLocator::isSearchedFor() const {
  return isSeen() && !odometry_.hasVelocity();
}

std::optional<FrameLocator::Placement> FrameLocator::placeFar(
    const Frame& frame, const Pose& guess, [[maybe_unused]] std::vector<PoseCandidate> candidates) {
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (isSeen()) {
    if (surfaces_) {
      for (const CloudRegistration& one : surfaces_->placesFar(pointsOf(*frame.cloud), guess)) {
        if (one.matched > 0) candidates.push_back(candidateOf(one));
      }
    }
    const ViewMap::Location far = views_->locate(
        view_, guess, candidates,
        lost_ > kFewLost ? ViewGuess::Nothing
                         : (odometry_.hasVelocity() ? ViewGuess::Motion : ViewGuess::Place));
    if (far.found && !mayHaveSlid(far.T_world_sensor))
      return helped(frame, far.T_world_sensor, covarianceByViews(), far.T_world_sensor, true);
    doubt_ = far.found ? kLooksTheSame : far.reason;
    return std::nullopt;
  }
#endif
  if (!surfaces_) return Placement{};
  const CloudRegistration far = surfaces_->locate(pointsOf(*frame.cloud), guess, lost_);
  const bool is_likely =
      (!isPartial(frame) && lost_ <= kFewLost) || isNear(guess, far.T_world_sensor, kStep, kTurn);
  return far.found && is_likely
             ? helped(frame, far.T_world_sensor, far.covariance, far.T_world_sensor, false)
             : Placement{};
}

/// A pose that the features may correct, unless the views object to what comes of it.
FrameLocator::Placement FrameLocator::helped(const Frame& frame, const Pose& T_world_sensor,
                                             const Matrix6& covariance, const Pose& expected,
                                             bool by_views) {
  PosePrior prior;
  prior.T_world_sensor = T_world_sensor;
  prior.covariance = covariance;
  const OdometryResult both = odometry_.locate(frame.key_features, prior);
  // Beside wrong features the few right ones only pull it away.
  const bool few = both.inliers < static_cast<std::size_t>(odometry_.params().jump_inliers);
  prior.exact = (by_views && (few || !both.registered)) ||
                (both.registered && !agrees(both.T_world_sensor, expected, false));
#ifdef PLANAR_MAPPING_HAS_STEREO
  prior.exact = prior.exact || (isSeen() && both.registered &&
                                views_->fitsBetter(view_, T_world_sensor, both.T_world_sensor));
#endif
  return {prior};
}

/// Whether the views speak for a pose; where they cannot tell, whether it is near where it was
/// expected.
/// \param likely  many features agree: enough where views cannot tell
bool FrameLocator::agrees([[maybe_unused]] const Pose& T_world_sensor,
                          [[maybe_unused]] const Pose& expected, [[maybe_unused]] bool likely) {
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (!isSeen()) return true;
  const PoseVerdict verdict =
      views_->check(view_, T_world_sensor, odometry_.hasVelocity() ? &expected : nullptr,
                    lost_ > kFewLost && !likely);
  if (verdict == PoseVerdict::Confirmed && !mayHaveSlid(T_world_sensor)) return true;
  // Without texture nothing keeps a camera from sliding along what its view leaves open.
  if (verdict == PoseVerdict::Unknown)
    return likely || (follows(T_world_sensor, expected) && !ViewMap::leavesOpen(view_));
  doubt_ = verdict == PoseVerdict::Doubtful  ? "earlier views hardly speak for the pose they give"
           : verdict == PoseVerdict::Refused ? "earlier views contradict the pose they give"
                                             : kLooksTheSame;
  return false;
#else
  return true;
#endif
}

/// Whether a pose is a small step from where it was expected, and the last frame had one.
bool FrameLocator::follows(const Pose& T_world_sensor, const Pose& expected) const {
  return lost_ == 0 && isNear(expected, T_world_sensor, 0.3, 0.3);
}

#ifdef PLANAR_MAPPING_HAS_STEREO
/// Whether a camera that was lost may be a few panels farther along what its view leaves open: it
/// seems to be where more of the known is seen, and not where it would be if it had gone on.
bool FrameLocator::mayHaveSlid(const Pose& T_world_sensor) const {
  constexpr double kOff = 0.5;  // metres, or of the way
  if (lost_ == 0 || !ViewMap::leavesOpen(view_)) return false;
  const Vector3 expected = odometry_.expectedPose().translation();
  const double way = (expected - last_pose_->translation()).norm();
  return (T_world_sensor.translation() - expected).norm() > kOff * std::max(1.0, way);
}
#endif

PoseCandidate FrameLocator::candidateOf(const CloudRegistration& by_cloud) const {
  constexpr double kMinFraction = 0.5;
  constexpr double kMaxSeenThrough = 0.05;
  return {by_cloud.T_world_sensor, by_cloud.fraction >= kMinFraction &&
                                       by_cloud.seen_through <= kMaxSeenThrough &&
                                       odometry_.params().motion.isCertain(by_cloud.covariance)};
}

void FrameLocator::noteCloud(const CloudRegistration& by_cloud) {
  cloud_reason_ =
      by_cloud.found
          ? "the cloud leaves a direction open, in which it may slide along walls or floor"
      : by_cloud.seen_through > surfaces_->params().max_seen_through
          ? "where the cloud would fit it sees through what was seen there before"
          : "the cloud does not lie on what was seen before";
}

std::string FrameLocator::reasonFor(const Frame& frame, const OdometryResult& result) const {
  std::string reason = result.reason;
  if (!frame.key_features.empty() && frame.images.left.empty()) {
    reason = "there is no image, and features sampled from a cloud tell no motion";
  } else if (frame.key_features.empty()) {
    reason = surfaces_ ? "there are no key features"
                       : "no pose is given and there are no key features to find one by";
  }
  if (cloud_reason_.empty()) return reason;
  // Of scans nobody expects features.
  return frame.camera || !frame.key_features.empty() ? reason + ", and " + cloud_reason_
                                                     : cloud_reason_;
}

}  // namespace planar_mapping::detail
