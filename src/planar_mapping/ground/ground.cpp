// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/ground/ground.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/ground/ground_model.h"

namespace planar_mapping {
namespace {

constexpr double kMax = 1e9;

void requireAngle(const char* name, double value, bool zero_allowed) {
  if (value < M_PI_2 && (zero_allowed ? value >= 0.0 : value > 0.0)) return;
  throw ParameterError(name, value, zero_allowed ? "[0, pi/2)" : "(0, pi/2)", "rad");
}

void requireDirection(const char* name, const Vector3& v) {
  const double length = v.norm();
  if (length > 1e-9 && length < kMax) return;
  throw ParameterError(std::string("length of ") + name, length, "> 0 and finite");
}

void requireLength(const char* name, double value) {
  requirePositive(name, value, "m");
  requireInRange(name, value, 0.0, kMax, "m");
}

/// False if all points that count are measured; else lists those that are.
bool hasNotMeasured(const PointsView& points, const Indices* indices, Indices& measured) {
  const std::size_t n = detail::countOf(points, indices);
  bool all = true;
  for (std::size_t k = 0; k < n; ++k) all = all & points.isMeasured(detail::at(indices, k));
  if (all) return false;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = detail::at(indices, k);
    if (points.isMeasured(i)) measured.push_back(static_cast<int>(i));
  }
  return true;
}

Ground findAmongMeasured(const PointsView& points, const Indices* indices,
                         const GroundParams& params) {
  Ground ground;
  const std::size_t n = detail::countOf(points, indices);
  ground.diagnostics.points_considered = n;
  const detail::GroundFrame frame(
      params, params.up ? *params.up : verticalOf(points, indices, Pose::Identity()));
  detail::GroundSample sample = detail::drawGroundSample(points, indices, params, frame);
  const auto sampled = static_cast<double>(sample.size());
  const double points_per_draw =
      static_cast<double>(n) / std::max<double>(1.0, std::min<double>(n, params.sample_size));
  detail::GroundEstimate estimate;
  if (sampled * points_per_draw < params.min_points) {
    ground.diagnostics.status = GroundStatus::TooFewPoints;
  } else {
    const double needed =
        std::max(params.min_fraction * sampled, params.min_points / points_per_draw);
    if (params.wall_height > 0.0) detail::dropUprights(sample, params, frame);
    ground.diagnostics.status =
        detail::estimateGround(sample, params, frame, needed, estimate, ground.diagnostics);
  }
  if (ground.diagnostics.status != GroundStatus::Found) {
    ground.is_ground.assign(n, 0);
    return ground;
  }

  ground.found = true;
  ground.height = estimate.plane.height();
  Pose T_cloud_ground = Pose::Identity();
  T_cloud_ground.linear() = frame.axes.transpose();
  const PlaneMoments moments = estimate.moments.transformed(T_cloud_ground);
  const PlaneMoments::Fit fit = moments.fit();
  ground.plane = orientedTowards(fit.plane, Vector3::Zero());
  ground.covariance = moments.planeCovariance(fit);
  ground.rms = fit.rms;
  const detail::GroundBends bends(sample, estimate, params, frame);
  ground.diagnostics.slope_cells = bends.followed;
  detail::labelGround(points, indices, params, frame, estimate.plane, bends, ground);
  return ground;
}

constexpr std::size_t kMinFrames = 5;  ///< that must agree on where the ground is

}  // namespace

void GroundParams::validate() const {
  if (camera_height) requireInRange("camera_height", *camera_height, 0.0, kMax, "m");
  requireLength("height_tolerance", height_tolerance);
  if (up) requireDirection("up", *up);
  requireDirection("optical_axis", optical_axis);
  requireAngle("pitch_tolerance", pitch_tolerance, false);
  requireAngle("roll_tolerance", roll_tolerance, false);
  requireLength("distance_threshold", distance_threshold);
  if (noise) noise->validate();
  requireInRange("noise_factor", noise_factor, 0.0, kMax);
  requireInRange("slope_cell", slope_cell, 0.0, kMax, "m");
  requireAngle("max_slope", max_slope, true);
  requireInRange("wall_height", wall_height, 0.0, kMax, "m");
  requireLength("wall_cell", wall_cell);
  requireLength("wall_foot_threshold", wall_foot_threshold);
  requirePositive("min_fraction", min_fraction);
  requireInRange("min_fraction", min_fraction, 0.0, 1.0);
  requireInRange("min_points", min_points, 3, std::numeric_limits<int>::max());
  requireInRange("sample_size", sample_size, 100, std::numeric_limits<int>::max());
  requireInRange("threads", threads, 0, 4096);
}

const char* toString(GroundStatus status) {
  switch (status) {
    case GroundStatus::Found:
      return "found";
    case GroundStatus::TooFewPoints:
      return "too few points";
    case GroundStatus::NoPlane:
      return "no plane within the height and angle tolerances";
    case GroundStatus::TooLittleSupport:
      return "too few points lie flat on the best plane";
    case GroundStatus::Elsewhere:
      return "a level surface, but not where the ground was before";
  }
  return "invalid";
}

Ground findGround(const PointsView& points, const Indices* indices, const GroundParams& params) {
  params.validate();
  detail::requireIndices(points, indices);
  Indices measured;
  if (!hasNotMeasured(points, indices, measured)) return findAmongMeasured(points, indices, params);
  // Points that are no measurement count for nothing: the sample is that of the others alone.
  Ground ground = findAmongMeasured(points, &measured, params);
  const std::size_t n = detail::countOf(points, indices);
  ground.diagnostics.points_considered = n;
  ground.diagnostics.points_not_measured = n - measured.size();
  const std::vector<std::uint8_t> marks =
      std::exchange(ground.is_ground, std::vector<std::uint8_t>(n, 0));
  auto mark = marks.begin();
  for (std::size_t k = 0; k < n; ++k) {
    if (points.isMeasured(detail::at(indices, k))) ground.is_ground[k] = *mark++;
  }
  return ground;
}

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
