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

/// Are two poses less than so many metres and radians apart?
bool isNear(const Pose& a, const Pose& b, double distance, double turn) {
  return (a.translation() - b.translation()).norm() < distance &&
         motionDifference(a, b).tail<3>().norm() < turn;
}

}  // namespace

Localization CloudLocator::locate(const PointsView& cloud, bool is_partial,
                                  const std::optional<Pose>& prior,
                                  const Matrix6& step_covariance) {
  constexpr std::size_t kTried = 2;  // tracks, the newest first
  Localization result;
  std::size_t tried = 0;
  for (auto known = tracks_.rbegin(); known != tracks_.rend() && tried < kTried; ++known, ++tried) {
    Track& track = known->second;
    const CloudRegistration found = prior && track.prior
                                        ? follow(track, cloud, *prior, step_covariance)
                                        : placeIn(track, cloud, is_partial);
    if (!found.found) {
      ++track.lost;
      continue;
    }
    result.submap = known->first;
    result.T_submap_camera = found.T_world_sensor;
    result.covariance_in_camera = found.covariance;
    track.T_before_now =
        track.lost == 0 ? track.T_track_sensor.inverse() * found.T_world_sensor : Pose::Identity();
    track.T_track_sensor = found.T_world_sensor;
    if (prior) track.prior = prior;
    track.lost = 0;
    track.map.insert(cloud, found.T_world_sensor);
    return result;
  }
  result.submap = tracks_.size();
  result.begins_submap = true;
  Track& track = tracks_.emplace(result.submap, Track{SurfaceMap(params_)}).first->second;
  track.prior = prior;
  track.map.insert(cloud, Pose::Identity());
  return result;
}

/// Nothing but surfaces tells whether a cloud fits. A camera is looked for where it was: the motion
/// before is no better; what spins is on a vehicle, which goes on.
CloudRegistration CloudLocator::placeIn(const Track& track, const PointsView& cloud,
                                        bool is_partial) {
  constexpr double kLittle = 0.5;  // of a view: it may lie better a little farther
  constexpr int kFewLost = 1;      // clouds: then a camera sees what it saw before them
  constexpr int kManyLost = 5;     // clouds: then nobody knows where what spins has gone
  constexpr double kStep = 1.0;    // metres: how far depth alone may place a cloud from where it is
  constexpr double kTurn = M_PI / 3.0;  // expected, and radians
  if (track.lost > (is_partial ? kFewLost : kManyLost)) return {};
  const Pose expected =
      is_partial ? track.T_track_sensor : track.T_track_sensor * track.T_before_now;
  CloudRegistration found = track.map.locateNear(cloud, expected, track.lost);
  const bool is_doubtful =
      is_partial ? found.fraction < kLittle : !isNear(expected, found.T_world_sensor, 0.3, 0.2);
  const bool is_free = !is_partial && track.lost <= kFewLost;  // to be anywhere
  if (!found.found) {
    found = track.map.locate(cloud, expected, track.lost);
    found.found = found.found && (is_free || isNear(expected, found.T_world_sensor, kStep, kTurn));
  } else if (is_doubtful) {
    found = track.map.locateFar(cloud, expected, found, track.lost);
    found.found = found.found &&
                  (track.lost <= kFewLost || isNear(expected, found.T_world_sensor, kStep, kTurn));
  }
  found.found = found.found && MotionParams().isCertain(found.covariance);
  return found;
}

/// By the step from the frame before as given, and by the cloud, each by its covariance. A cloud
/// farther off than both may be says nothing.
CloudRegistration CloudLocator::follow(Track& track, const PointsView& cloud, const Pose& prior,
                                       const Matrix6& step_covariance) {
  constexpr double kCautious = 0.2;   // of its deviations: registration states them too large
  constexpr double kFarthest = 22.5;  // 99.9 % of the squared distances, 6 degrees of freedom
  const Pose expected = track.T_track_sensor * (track.prior->inverse() * prior);
  CloudRegistration result = track.map.locateNear(cloud, expected, track.lost);
  const Matrix6 of_given = ++track.uncorrected * step_covariance;
  const Matrix6 of_both = of_given + kCautious * kCautious * result.covariance;
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

std::optional<Localization> FrameLocator::locate(const Frame& frame,
                                                 const Matrix6* step_covariance) {
  std::optional<Pose> prior;
  if (step_covariance != nullptr) prior = frame.given_pose;
#ifdef PLANAR_MAPPING_HAS_STEREO
  if (!images_ && !clouds_ && showsItsCloud(frame)) images_.emplace(keys_.localizerNow());
  if (images_) {
    if (!showsItsCloud(frame)) return std::nullopt;
    LocalizerFrame seen;
    seen.gray = io::toGray(frame.images.left);
    seen.cloud = pointsOf(*frame.cloud);
    seen.camera = *frame.camera;
    seen.timestamp = frame.timestamp;
    seen.prior = prior;
    if (prior) seen.prior_covariance = *step_covariance;
    return images_->locate(seen);
  }
#endif
  if (!clouds_) clouds_.emplace(keys_.surfaceFor(frame));
  const bool is_partial =
      frame.camera || (frame.cloud->height > 1 && !keys_.surface.optical_axis.isZero());
  return clouds_->locate(pointsOf(*frame.cloud), is_partial, prior,
                         prior ? *step_covariance : Matrix6::Zero());
}

}  // namespace planar_mapping::detail
