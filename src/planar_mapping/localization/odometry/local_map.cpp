// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/odometry/local_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <optional>

#include "planar_mapping/localization/odometry/motion_refinement.h"

namespace planar_mapping::detail {

namespace {

/// What a sighting says about a point (world frame), linearised at the point, and where it would
/// put it.
struct PointInformation {
  Matrix3 information = Matrix3::Zero();
  Vector3 position = Vector3::Zero();
};

/// \return nothing where the point is not in front of the camera
std::optional<PointInformation> informationOf(const FeatureCamera& camera,
                                              const Pose& T_sensor_world, const Vector3& point,
                                              const FeatureSighting& seen) {
  const Vector3 p = T_sensor_world * point;
  if (!(p.z() > kNearestDepth)) return std::nullopt;
  const FeatureSighting predicted = project(camera, p);
  const Vector3 error(seen.column - predicted.column, seen.row - predicted.row,
                      seen.inverse_depth - predicted.inverse_depth);
  const Matrix3 jacobian = projectionJacobian(camera, p) * T_sensor_world.linear();
  const Vector3 weight = sightingVariance(camera, seen.inverse_depth).cwiseInverse();
  PointInformation result{jacobian.transpose() * weight.asDiagonal() * jacobian,
                          point + jacobian.inverse() * error};
  if (!result.information.allFinite() || !result.position.allFinite()) return std::nullopt;
  return result;
}

}  // namespace

const Landmark* LocalMap::find(std::int64_t track) const {
  const auto found = landmarks_.find(track);
  return found == landmarks_.end() ? nullptr : &found->second;
}

Landmark* LocalMap::find(std::int64_t track) {
  return const_cast<Landmark*>(std::as_const(*this).find(track));
}

Landmark LocalMap::landmarkOf(const Pose& T_sensor_world, const FeatureSighting& sighting,
                              std::int64_t frame) const {
  Landmark landmark;
  landmark.position = T_sensor_world.inverse() * backProject(params_.camera, sighting);
  landmark.last_frame = frame;
  const auto seen = informationOf(params_.camera, T_sensor_world, landmark.position, sighting);
  if (seen) landmark.information = seen->information;
  return landmark;
}

void LocalMap::move(Landmark& landmark, const Pose& T_sensor_world,
                    const FeatureSighting& sighting) const {
  const auto seen = informationOf(params_.camera, T_sensor_world, landmark.position, sighting);
  if (!seen) return;
  const Matrix3 sum = landmark.information + seen->information;
  Matrix3 covariance;
  if (!invertCovariance(sum, covariance)) return;
  landmark.position =
      covariance * (landmark.information * landmark.position + seen->information * seen->position);
  landmark.information = sum;
}

void LocalMap::add(const Pose& T_sensor_world, const std::vector<TrackSighting>& sightings,
                   std::int64_t frame, bool is_keyframe) {
  for (const auto& [track, sighting] : sightings) {
    if (Landmark* known = find(track)) {
      known->last_frame = frame;
      if (is_keyframe) move(*known, T_sensor_world, sighting);
    } else {
      landmarks_.emplace(track, landmarkOf(T_sensor_world, sighting, frame));
      if (!is_keyframe) passing_.push_back(track);
    }
  }
  if (is_keyframe) limitLandmarks(frame);
}

void LocalMap::removePassing() {
  for (const std::int64_t track : passing_) landmarks_.erase(track);
  passing_.clear();
}

/// Those not seen for longest go first, those of this frame never.
void LocalMap::limitLandmarks(std::int64_t frame) {
  const auto limit = static_cast<std::size_t>(params_.max_landmarks);
  if (landmarks_.size() <= limit) return;
  std::vector<std::pair<std::int64_t, std::int64_t>> idle;  // last frame, track
  for (const auto& [track, landmark] : landmarks_) {
    if (landmark.last_frame != frame) idle.push_back({landmark.last_frame, track});
  }
  // A tenth more than needed: not again with every keyframe.
  const std::size_t surplus = std::min(idle.size(), landmarks_.size() - limit + limit / 10);
  std::sort(idle.begin(), idle.end());
  for (std::size_t i = 0; i < surplus; ++i) landmarks_.erase(idle[i].second);
}

}  // namespace planar_mapping::detail
