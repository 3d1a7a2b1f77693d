// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "base/point_indices.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/ground/ground.h"

namespace planar_mapping {
namespace {

constexpr std::size_t kMinFrames = 5;  ///< that must agree on where the ground is

}  // namespace

bool isCameraView(const PointsView& points, const Indices* indices) {
  constexpr std::size_t kMaxSample = 100000;
  constexpr float kFarthest = 1e12f;
  constexpr double kMaxSlope = 2.0;  // 63 degrees; a scan with its floor at z = 0 goes beyond
  constexpr double kMinFraction = 0.99;
  const auto isUsable = [&](std::size_t i) {
    const float* p = points[i];
    return std::abs(p[0]) <= kFarthest && std::abs(p[1]) <= kFarthest &&
           std::abs(p[2]) <= kFarthest;
  };
  detail::requireIndices(points, indices);
  const std::size_t n = detail::countOf(points, indices);
  std::size_t usable = 0;
  for (std::size_t k = 0; k < n; ++k) usable += isUsable(detail::at(indices, k)) ? 1 : 0;
  const std::size_t step = usable / kMaxSample + 1;
  std::size_t number = 0;
  std::size_t sampled = 0;
  std::size_t in_view = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = detail::at(indices, k);
    if (!isUsable(i) || number++ % step != 0) continue;
    const Vector3 p = points.point(i);
    ++sampled;
    in_view += p.z() > 0.0 && p.head<2>().norm() < kMaxSlope * p.z() ? 1 : 0;
  }
  return sampled > 0 && static_cast<double>(in_view) >= kMinFraction * static_cast<double>(sampled);
}

Vector3 verticalOf(const PointsView& points, const Indices* indices, const Pose& T_world_sensor) {
  if (!isCameraView(points, indices)) return Vector3::UnitZ();
  const Vector3 up = T_world_sensor.linear() * -Vector3::UnitY();
  Eigen::Index axis = 0;
  up.cwiseAbs().maxCoeff(&axis);
  return up[axis] < 0.0 ? Vector3(-Vector3::Unit(axis)) : Vector3(Vector3::Unit(axis));
}

void GroundTracker::setParams(const GroundParams& params) {
  params.validate();
  params_ = params;
  if (params.up) up_ = params.up->normalized();
}

Ground GroundTracker::update(const PointsView& points, const Indices* indices,
                             const Pose& T_world_sensor) {
  if (!T_world_sensor.matrix().allFinite()) {
    throw InputError("the pose of the sensor is not finite");
  }
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
