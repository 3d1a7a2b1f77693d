// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "planar_mapping/core/odometry/odometry.h"

namespace planar_mapping::detail {

/// A feature at its place in the world.
struct Landmark {
  Vector3 position = Vector3::Zero();
  Matrix3 information = Matrix3::Zero();  ///< of position, from all that was seen
  /// What keyframes that are no longer kept knew.
  Vector3 prior_position = Vector3::Zero();
  Matrix3 prior_information = Matrix3::Zero();
  int sightings = 0;            ///< in kept keyframes
  std::int64_t last_frame = 0;  ///< it was seen in
  int disagreements = 0;        ///< in a row

  template <typename Archive>
  void visitState(Archive& archive) {
    archive(position, information, prior_position, prior_information, sightings, last_frame,
            disagreements);
  }
};

struct Keyframe {
  Pose T_sensor_world = Pose::Identity();
  bool fixed = false;
  std::optional<MotionPrior> prior;
  std::vector<std::pair<std::int64_t, FeatureSighting>> sightings;  ///< by track

  template <typename Archive>
  void visitState(Archive& archive) {
    bool has_prior = prior.has_value();
    archive(T_sensor_world, fixed, sightings, has_prior);
    if (!has_prior) return;
    if (!prior) prior.emplace();
    archive(prior->T_now_before, prior->covariance);
  }
};

/// Landmarks and the keyframes that saw them. Bounded: see OdometryParams.
class LocalMap {
 public:
  explicit LocalMap(const OdometryParams& params) : params_(params) {}

  const Landmark* find(std::int64_t track) const;
  Landmark* find(std::int64_t track);
  std::size_t landmarks() const { return landmarks_.size(); }
  const std::vector<Keyframe>& keyframes() const { return keyframes_; }

  /// Adds a keyframe; its sightings of unknown tracks become landmarks. Corrects the last
  /// keyframes and all landmarks they see.
  void add(Keyframe keyframe, std::int64_t frame);
  /// Landmarks of a frame that is no keyframe, so that the next frame can be registered to it. They
  /// vanish with the next call of removePassing().
  void addPassing(const Pose& T_sensor_world,
                  const std::vector<std::pair<std::int64_t, FeatureSighting>>& sightings,
                  std::int64_t frame);
  void removePassing();
  void remove(std::int64_t track);
  template <typename Archive>
  void visitState(Archive& archive) {
    archive(landmarks_, keyframes_, passing_);
  }

 private:
  void addLandmark(std::int64_t track, const Pose& T_sensor_world, const FeatureSighting& sighting,
                   std::int64_t frame);
  void adjust();
  void removeOutliers(std::size_t first_free);
  void updateInformation(bool positions);
  void dropOldest();
  void limitLandmarks();

  OdometryParams params_;
  std::map<std::int64_t, Landmark> landmarks_;  // ordered: results must not depend on hashing
  std::vector<Keyframe> keyframes_;
  std::vector<std::int64_t> passing_;
};

}  // namespace planar_mapping::detail
