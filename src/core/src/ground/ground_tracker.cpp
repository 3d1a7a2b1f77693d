// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "planar_mapping/core/ground/ground.h"

namespace planar_mapping {
namespace {

constexpr std::size_t kMinFrames = 5;  ///< that must agree on where the ground is

}  // namespace

void GroundTracker::setParams(const GroundParams& params) {
  params.validate();
  const bool was_given = params_.up.has_value();
  params_ = params;
  if (params.up) {
    up_ = params.up->normalized();
  } else if (was_given) {
    up_.reset();
  }
}

Ground GroundTracker::update(const PointsView& points, const Indices* indices,
                             const Pose& T_world_sensor) {
  requireRigid("the pose of the sensor", T_world_sensor);
  const Vector3 up = up_ ? *up_ : verticalOf(points, indices, T_world_sensor);
  GroundParams params = params_;
  params.up = T_world_sensor.linear().transpose() * up;
  const double altitude = up.dot(T_world_sensor.translation());
  Ground ground = params.camera_height ? findGround(points, indices, params)
                                       : findExpected(points, indices, altitude, params);
  if (ground.found) up_ = up;  // an empty cloud tells no vertical
  return ground;
}

/// The ground where that of the frames before lets one expect it.
Ground GroundTracker::findExpected(const PointsView& points, const Indices* indices,
                                   double altitude, GroundParams params) {
  if (level_ && altitude - *level_ > params.height_tolerance) {
    params.camera_height = altitude - *level_;
    const Ground ground = findGround(points, indices, params);
    if (ground.found) {
      level_ = altitude - ground.height;  // slopes and drift are followed
      levels_.clear();
      return ground;
    }
  }
  // What is elsewhere is a table rather than the ground, unless it is there again and again: the
  // camera was lifted without its pose, or the level was a table's.
  params.camera_height.reset();
  Ground ground = findGround(points, indices, params);
  if (!ground.found) return ground;
  learn(altitude - ground.height);
  if (!level_ || std::fabs(altitude - ground.height - *level_) <= params.height_tolerance) {
    return ground;
  }
  Ground none;
  none.is_ground.assign(ground.is_ground.size(), 0);
  none.diagnostics = ground.diagnostics;
  none.diagnostics.status = GroundStatus::Elsewhere;
  none.diagnostics.ground_points = 0;
  return none;
}

/// Takes the median of the last levels for that of the ground if they agree.
void GroundTracker::learn(double level) {
  levels_.push_back(level);
  if (levels_.size() < kMinFrames) return;
  std::vector<double> sorted = levels_;
  std::sort(sorted.begin(), sorted.end());
  levels_.erase(levels_.begin());
  if (sorted.back() - sorted.front() > params_.height_tolerance) return;
  level_ = sorted[kMinFrames / 2];
  levels_.clear();
}

}  // namespace planar_mapping
