// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/motion/frame_locator.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "planar_mapping/localization/odometry/motion_estimation.h"
#include "planar_mapping/pipeline/keyframe_view.h"

namespace planar_mapping::detail {
namespace {

/// Are two poses less than 0.3 m and 0.2 radians apart?
bool isNear(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).norm() < 0.3 &&
         motionDifference(a, b).tail<3>().norm() < 0.2;
}

}  // namespace

Localization CloudLocator::locate(const PointsView& cloud, bool is_partial,
                                  const std::optional<Pose>& prior, const Matrix6& step_covariance,
                                  const std::function<Pose()>& start) {
  constexpr std::size_t kTried = 2;  // tracks, the newest first
  Localization result;
  std::size_t tried = 0;
  for (auto known = tracks_.rbegin(); known != tracks_.rend() && tried < kTried; ++known, ++tried) {
    Track& track = known->second;
    const auto lost = static_cast<int>(frames_ - track.frame) - 1;
    const bool is_followed = prior && track.T_track_given;
    const CloudRegistration found = is_followed ? follow(track, cloud, *prior, step_covariance)
                                                : placeIn(track, cloud, is_partial, lost);
    if (!found.found) continue;
    result.submap = known->first;
    result.T_submap_camera = found.T_world_sensor;
    result.covariance_in_camera = found.covariance;
    result.drift_in_camera = found.covariance;
    track.T_before_now = Pose::Identity();
    if (lost == 0) track.T_before_now = track.T_track_sensor.inverse() * found.T_world_sensor;
    track.T_track_sensor = found.T_world_sensor;
    if (prior) track.T_track_given = found.T_world_sensor * prior->inverse();
    track.frame = frames_++;
    track.map.insert(cloud, found.T_world_sensor);
    return result;
  }
  result.submap = tracks_.size();
  result.begins_submap = true;
  result.T_submap_camera = start();
  Track& track = tracks_.try_emplace(result.submap, params_).first->second;
  track.T_track_sensor = result.T_submap_camera;
  if (prior) track.T_track_given = result.T_submap_camera * prior->inverse();
  track.frame = frames_++;
  track.map.insert(cloud, result.T_submap_camera);
  return result;
}

/// Nothing but surfaces tells whether a cloud fits. A camera is looked for where it was: the motion
/// before is no better; what spins is on a vehicle, which goes on.
CloudRegistration CloudLocator::placeIn(const Track& track, const PointsView& cloud,
                                        bool is_partial, int lost) {
  constexpr double kLittle = 0.5;  // of a view: it may lie better a little farther
  constexpr int kMostLost = 1;     // clouds: then what was seen before them is seen again
  if (lost > kMostLost) return {};
  const Pose expected =
      is_partial ? track.T_track_sensor : track.T_track_sensor * track.T_before_now;
  CloudRegistration found = track.map.locateNear(cloud, expected, lost);
  const bool is_doubtful =
      is_partial ? found.fraction < kLittle : !isNear(expected, found.T_world_sensor);
  if (!found.found || is_doubtful) found = track.map.locateFar(cloud, expected, found, lost);
  found.found = found.found && MotionParams().isCertain(found.covariance);
  return found;
}

/// By the step from the frame before as given, and by the cloud, each by its covariance. A cloud
/// farther off than both may be says nothing.
CloudRegistration CloudLocator::follow(Track& track, const PointsView& cloud, const Pose& prior,
                                       const Matrix6& step_covariance) {
  constexpr double kFarthest = 22.5;  // 99.9 % of the squared distances, 6 degrees of freedom
  const Pose expected = *track.T_track_given * prior;
  CloudRegistration result = track.map.locateNear(cloud, expected);
  const Matrix6 of_given = 0.5 * ++track.uncorrected * step_covariance;  // of one pose
  const Matrix6 of_both = of_given + result.covariance;
  const Vector6 off =
      motionDifference(Pose::Identity(), expected.inverse() * result.T_world_sensor);
  const Vector6 weighed = of_both.ldlt().solve(off);
  const bool tells = result.found && off.dot(weighed) <= kFarthest;
  if (tells) track.uncorrected = 0;
  result.T_world_sensor = tells ? Pose(expected * motionStep(of_given * weighed)) : expected;
  result.covariance = of_given;
  result.found = true;
  return result;
}

Pose FrameLocator::startOf(Frame& frame, bool by_guess) const {
  frame.starts_world = !frame.given_pose || !(by_guess || keys_.start.isGiven());
  if (by_guess) return *frame.given_pose;
  return keys_.start.of(frame, is_optical_, keys_.noise.optionalNoise());
}

std::optional<Localization> FrameLocator::locate(Frame& frame, const Matrix6* step_covariance) {
  std::optional<Pose> prior;
  if (step_covariance != nullptr) prior = frame.given_pose;
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (!images_ && !clouds_ && showsItsCloud(frame)) images_.emplace(keys_.localizerNow());
  if (images_) {
    if (!showsItsCloud(frame)) return std::nullopt;
    return locateImage(frame, prior, step_covariance);
  }
#endif
  if (!clouds_) clouds_.emplace(keys_.surfaceFor(frame));
  const bool is_partial =
      frame.camera || (frame.cloud->height > 1 && !keys_.surface.optical_axis.isZero());
  return clouds_->locate(pointsOf(*frame.cloud), is_partial, prior,
                         prior ? *step_covariance : Matrix6::Zero(),
                         [&]() { return startOf(frame, prior.has_value()); });
}

#ifdef PLANAR_MAPPING_HAS_STEREO
Localization FrameLocator::locateImage(Frame& frame, const std::optional<Pose>& prior,
                                       const Matrix6* step_covariance) {
  LocalizerFrame seen;
  seen.gray = io::toGray(frame.images.left);
  seen.cloud = pointsOf(*frame.cloud);
  seen.camera = *frame.camera;
  seen.prior = prior;
  if (prior) seen.prior_covariance = *step_covariance;
  Localization found = images_->locate(seen);
  if (found.begins_submap) T_world_start_[found.submap] = startOf(frame, prior.has_value());
  const Pose& T_world_start = T_world_start_.at(found.submap);
  found.T_submap_camera = T_world_start * found.T_submap_camera;
  if (found.joined) {
    JoinedSubmap& joined = *found.joined;
    joined.T_other_submap =
        T_world_start * joined.T_other_submap * T_world_start_.at(joined.submap).inverse();
    joined.covariance = turnedCovariance(T_world_start, joined.covariance);
  }
  return found;
}
#endif

}  // namespace planar_mapping::detail
