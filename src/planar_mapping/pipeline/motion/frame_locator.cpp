// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/motion/frame_locator.h"

#include <utility>

#include "planar_mapping/pipeline/keyframe_view.h"

namespace planar_mapping::detail {

Localization CloudLocator::locate(const PointsView& cloud, const std::optional<Pose>& prior) {
  constexpr std::size_t kTried = 2;  // tracks, the newest first
  Localization result;
  std::size_t tried = 0;
  for (auto known = tracks_.rbegin(); known != tracks_.rend() && tried < kTried; ++known, ++tried) {
    Track& track = known->second;
    const CloudRegistration found = placeIn(track, cloud, prior);
    if (!found.found) {
      ++track.lost;
      continue;
    }
    result.submap = known->first;
    result.T_submap_camera = found.T_world_sensor;
    result.covariance_in_camera = found.covariance;
    track.T_before_now = track.lost == 0 ? track.T_track_sensor.inverse() * found.T_world_sensor
                                         : Pose::Identity();
    track.T_track_sensor = found.T_world_sensor;
    track.prior = prior;
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

CloudRegistration CloudLocator::placeIn(const Track& track, const PointsView& cloud,
                                        const std::optional<Pose>& prior) const {
  Pose expected = track.T_track_sensor * track.T_before_now;
  if (prior && track.prior) expected = track.T_track_sensor * (track.prior->inverse() * *prior);
  return track.map.locate(cloud, expected, track.lost);
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
  return clouds_->locate(pointsOf(*frame.cloud), prior);
}

}  // namespace planar_mapping::detail
