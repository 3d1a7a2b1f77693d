// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "planar_mapping/localization/odometry/odometry.h"

namespace planar_mapping::detail {

/// A feature at its place in the world, and how well that is known: an information filter.
struct Landmark {
  Vector3 position = Vector3::Zero();
  Matrix3 information = Matrix3::Zero();  ///< of position, from all that was seen
  std::int64_t last_frame = 0;            ///< it was seen in
  int disagreements = 0;                  ///< in a row
};

using TrackSighting = std::pair<std::int64_t, FeatureSighting>;

/// Landmarks by track. Bounded: see OdometryParams.
class LocalMap {
 public:
  explicit LocalMap(const OdometryParams& params) : params_(params) {}

  const Landmark* find(std::int64_t track) const;
  Landmark* find(std::int64_t track);
  std::size_t landmarks() const { return landmarks_.size(); }

  /// Unknown tracks become landmarks, so that the next frame can be registered to them; those of a
  /// frame that is no keyframe vanish with the next call of removePassing(). By a keyframe known
  /// ones move to where all that was seen of them says.
  void add(const Pose& T_sensor_world, const std::vector<TrackSighting>& sightings,
           std::int64_t frame, bool is_keyframe);
  void removePassing();
  void remove(std::int64_t track) { landmarks_.erase(track); }

 private:
  Landmark landmarkOf(const Pose& T_sensor_world, const FeatureSighting& sighting,
                      std::int64_t frame) const;
  void move(Landmark& landmark, const Pose& T_sensor_world, const FeatureSighting& sighting) const;
  void limitLandmarks(std::int64_t frame);

  OdometryParams params_;
  std::map<std::int64_t, Landmark> landmarks_;  // ordered: results must not depend on hashing
  std::vector<std::int64_t> passing_;
};

}  // namespace planar_mapping::detail
