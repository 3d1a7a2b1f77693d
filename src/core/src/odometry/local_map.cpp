// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "odometry/local_map.h"

#include <Eigen/LU>
#include <algorithm>

#include "odometry/bundle_adjustment.h"
#include "odometry/motion_refinement.h"

namespace planar_mapping::detail {

const Landmark* LocalMap::find(std::int64_t track) const {
  const auto found = landmarks_.find(track);
  return found == landmarks_.end() ? nullptr : &found->second;
}

Landmark* LocalMap::find(std::int64_t track) {
  const auto found = landmarks_.find(track);
  return found == landmarks_.end() ? nullptr : &found->second;
}

void LocalMap::addLandmark(std::int64_t track, const Pose& T_sensor_world,
                           const FeatureSighting& sighting, std::int64_t frame) {
  Landmark landmark;
  landmark.position = T_sensor_world.inverse() * backProject(params_.camera, sighting);
  landmark.prior_position = landmark.position;
  landmark.last_frame = frame;
  Vector3 unused;
  sightingInformation(params_.camera, T_sensor_world, landmark.position, sighting,
                      landmark.information, unused);
  landmarks_.emplace(track, landmark);
}

void LocalMap::add(Keyframe keyframe, std::int64_t frame) {
  for (const auto& [track, sighting] : keyframe.sightings) {
    Landmark* landmark = find(track);
    if (landmark == nullptr) {
      addLandmark(track, keyframe.T_sensor_world, sighting, frame);
      landmark = find(track);
    }
    landmark->last_frame = frame;
    ++landmark->sightings;
  }
  keyframes_.push_back(std::move(keyframe));
  adjust();
  if (keyframes_.size() > static_cast<std::size_t>(params_.max_keyframes)) dropOldest();
  limitLandmarks();
}

void LocalMap::addPassing(const Pose& T_sensor_world,
                          const std::vector<std::pair<std::int64_t, FeatureSighting>>& sightings,
                          std::int64_t frame) {
  for (const auto& [track, sighting] : sightings) {
    if (Landmark* known = find(track)) {
      known->last_frame = frame;
    } else {
      addLandmark(track, T_sensor_world, sighting, frame);
      passing_.push_back(track);
    }
  }
}

void LocalMap::removePassing() {
  for (const std::int64_t track : passing_) landmarks_.erase(track);
  passing_.clear();
}

void LocalMap::remove(std::int64_t track) {
  landmarks_.erase(track);
  for (Keyframe& keyframe : keyframes_) {
    auto& seen = keyframe.sightings;
    seen.erase(std::remove_if(seen.begin(), seen.end(),
                              [track](const auto& s) { return s.first == track; }),
               seen.end());
  }
}

void LocalMap::adjust() {
  const std::size_t count = keyframes_.size();
  const auto window = static_cast<std::size_t>(params_.window);
  const std::size_t first_free = count > window ? count - window : 0;
  // Of the landmarks, those the free keyframes see.
  std::map<std::int64_t, std::size_t> number;
  std::vector<BundlePoint> points;
  std::vector<Landmark*> changed;
  for (std::size_t k = first_free; k < count; ++k) {
    for (const auto& seen : keyframes_[k].sightings) {
      if (!number.emplace(seen.first, points.size()).second) continue;
      Landmark* landmark = find(seen.first);
      points.push_back({landmark->position, landmark->prior_position, landmark->prior_information});
      changed.push_back(landmark);
    }
  }
  std::vector<BundleFrame> frames;
  for (std::size_t k = 0; k < count; ++k) {
    const Keyframe& keyframe = keyframes_[k];
    BundleFrame frame{
        keyframe.T_sensor_world, keyframe.fixed || k < first_free, keyframe.prior, {}};
    for (const auto& [track, sighting] : keyframe.sightings) {
      const auto found = number.find(track);
      if (found != number.end()) frame.sightings.push_back({found->second, sighting});
    }
    frames.push_back(std::move(frame));
  }
  const bool adjusted = adjustBundle(params_.camera, params_.motion.huber_sigmas,
                                     params_.adjustment_iterations, frames, points);
  if (adjusted) {
    for (std::size_t i = 0; i < points.size(); ++i) changed[i]->position = points[i].position;
    for (std::size_t k = 0; k < count; ++k) keyframes_[k].T_sensor_world = frames[k].T_sensor_world;
    removeOutliers(first_free);
  }
  updateInformation(!adjusted);
}

void LocalMap::removeOutliers(std::size_t first_free) {
  const double limit = params_.motion.inlier_sigmas * params_.motion.inlier_sigmas;
  for (std::size_t k = first_free; k < keyframes_.size(); ++k) {
    Keyframe& keyframe = keyframes_[k];
    auto kept = keyframe.sightings.begin();
    for (const auto& seen : keyframe.sightings) {
      Landmark* landmark = find(seen.first);
      const bool agrees = sightingDistance(params_.camera, keyframe.T_sensor_world,
                                           landmark->position, seen.second) <= limit;
      if (agrees) {
        *kept++ = seen;
      } else {
        --landmark->sightings;
      }
    }
    keyframe.sightings.erase(kept, keyframe.sightings.end());
  }
  for (auto it = landmarks_.begin(); it != landmarks_.end();) {
    const bool known = it->second.sightings > 0 || !it->second.prior_information.isZero();
    it = known ? std::next(it) : landmarks_.erase(it);
  }
}

/// Sums up what the keyframes know of each landmark; with \p positions, also where it is by that.
void LocalMap::updateInformation(bool positions) {
  struct Sum {
    Landmark* landmark = nullptr;
    Matrix3 information = Matrix3::Zero();
    Vector3 weighted = Vector3::Zero();
  };
  std::map<std::int64_t, Sum> sums;
  for (const Keyframe& keyframe : keyframes_) {
    for (const auto& [track, sighting] : keyframe.sightings) {
      Sum& sum = sums[track];
      if (sum.landmark == nullptr) {
        sum.landmark = find(track);
        sum.information = sum.landmark->prior_information;
        sum.weighted = sum.landmark->prior_information * sum.landmark->prior_position;
      }
      Matrix3 information;
      Vector3 position;
      if (sightingInformation(params_.camera, keyframe.T_sensor_world, sum.landmark->position,
                              sighting, information, position)) {
        sum.information += information;
        sum.weighted += information * position;
      }
    }
  }
  for (auto& [track, sum] : sums) {
    sum.landmark->information = sum.information;
    Matrix3 covariance;
    if (positions && invertCovariance(sum.information, covariance)) {
      sum.landmark->position = covariance * sum.weighted;
    }
  }
}

/// What the oldest keyframe knows of its landmarks becomes their prior.
void LocalMap::dropOldest() {
  const Keyframe& oldest = keyframes_.front();
  for (const auto& [track, sighting] : oldest.sightings) {
    Landmark* landmark = find(track);
    --landmark->sightings;
    Matrix3 information;
    Vector3 position;
    if (!sightingInformation(params_.camera, oldest.T_sensor_world, landmark->position, sighting,
                             information, position)) {
      continue;
    }
    const Matrix3 sum = landmark->prior_information + information;
    Matrix3 covariance;
    if (!invertCovariance(sum, covariance)) continue;
    landmark->prior_position =
        covariance *
        (landmark->prior_information * landmark->prior_position + information * position);
    landmark->prior_information = sum;
  }
  keyframes_.erase(keyframes_.begin());
}

void LocalMap::limitLandmarks() {
  const auto limit = static_cast<std::size_t>(params_.max_landmarks);
  if (landmarks_.size() <= limit) return;
  std::vector<std::pair<std::int64_t, std::int64_t>> idle;  // last frame, track
  for (const auto& [track, landmark] : landmarks_) {
    if (landmark.sightings == 0) idle.push_back({landmark.last_frame, track});
  }
  // A tenth more than needed: not again with every keyframe.
  const std::size_t surplus = std::min(idle.size(), landmarks_.size() - limit + limit / 10);
  std::sort(idle.begin(), idle.end());
  for (std::size_t i = 0; i < surplus; ++i) landmarks_.erase(idle[i].second);
}

}  // namespace planar_mapping::detail
