// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/ground/detail/upright.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/geometry/cloud_scale.h"

namespace planar_mapping {
namespace {

constexpr std::size_t kMostPlanes = 20;
/// Planes that meet at a smaller angle do not fix the line in which they meet: its sine.
constexpr double kLeastMeeting = 0.5;
/// Directions closer together than this are the same one, seen with different errors.
constexpr double kSameDirection = 10.0 * M_PI / 180.0;

struct WeightedPlane {
  Plane plane;
  double weight = 0.0;  ///< share of the points on planes
};

struct Support {
  double horizontal = 0.0;
  double vertical = 0.0;
  double ground = 0.0;  ///< the largest horizontal plane below the sensor
  double total() const { return horizontal + vertical; }
};

double angleBetween(const Vector3& a, const Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Support supportOf(const Vector3& up, const std::vector<WeightedPlane>& planes, double tolerance) {
  Support support;
  for (const WeightedPlane& one : planes) {
    const double along = up.dot(one.plane.normal);
    if (std::abs(along) > std::cos(tolerance)) {
      support.horizontal += one.weight;
      const double height = along * one.plane.signedDistance(Vector3::Zero());
      if (height > 0.0) support.ground = std::max(support.ground, one.weight);
    } else if (std::abs(along) < std::sin(tolerance)) {
      support.vertical += one.weight;
    }
  }
  return support;
}

/// The direction next to all that is horizontal or vertical, least squares of the angles; \p up
/// where a single wall leaves it open.
Vector3 fitted(const Vector3& up, const std::vector<WeightedPlane>& planes, double tolerance) {
  constexpr double kLeastShare = 0.03;  // of the planes that must hold each turn
  Matrix3 sum = Matrix3::Zero();
  for (const WeightedPlane& one : planes) {
    const Vector3& n = one.plane.normal;
    const double along = std::abs(up.dot(n));
    if (along > std::cos(tolerance)) {
      sum += one.weight * (Matrix3::Identity() - n * n.transpose());
    } else if (along < std::sin(tolerance)) {
      sum += one.weight * n * n.transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(sum);
  if (!(solver.eigenvalues()[1] > kLeastShare * sum.trace())) return up;
  const Vector3 best = solver.eigenvectors().col(0);
  return best.dot(up) < 0.0 ? Vector3(-best) : best;
}

std::vector<WeightedPlane> largest(const std::vector<PlaneSegment>& planes) {
  std::vector<WeightedPlane> result;
  for (const PlaneSegment& segment : planes) {
    if (!segment.plane.normal.allFinite() || segment.inliers.empty()) continue;
    result.push_back({segment.plane, static_cast<double>(segment.inliers.size())});
  }
  std::stable_sort(
      result.begin(), result.end(),
      [](const WeightedPlane& a, const WeightedPlane& b) { return a.weight > b.weight; });
  if (result.size() > kMostPlanes) result.resize(kMostPlanes);
  double sum = 0.0;
  for (const WeightedPlane& one : result) sum += one.weight;
  for (WeightedPlane& one : result) one.weight /= sum;
  return result;
}

/// Directions upwards that the planes could mean, within the largest tilt.
std::vector<Vector3> candidates(const std::vector<WeightedPlane>& planes, const Vector3& level,
                                double max_tilt) {
  std::vector<Vector3> result;
  const auto add = [&](const Vector3& direction) {
    const Vector3 up = direction.dot(level) < 0.0 ? Vector3(-direction) : direction;
    if (angleBetween(up, level) <= max_tilt) result.push_back(up);
  };
  for (std::size_t i = 0; i < planes.size(); ++i) {
    add(planes[i].plane.normal);
    for (std::size_t j = 0; j < i; ++j) {
      const Vector3 line = planes[i].plane.normal.cross(planes[j].plane.normal);
      if (line.norm() > kLeastMeeting) add(line.normalized());
    }
  }
  return result;
}

}  // namespace

void UprightParams::validate() const {
  if (!expected_up.allFinite() || !(expected_up.norm() > 0.0)) {
    throw ParameterError("expected_up", expected_up.norm(), "finite, not zero");
  }
  const auto requireAngle = [](const char* name, double value, double most, const char* range) {
    if (!(value > 0.0 && value < most)) throw ParameterError(name, value, range, "rad");
  };
  requireAngle("max_tilt", max_tilt, M_PI / 2.0, "(0, pi/2)");
  requirePositive("usual_tilt", usual_tilt, "rad");
  requireInRange("level_tolerance", level_tolerance, 0.0, max_tilt, "rad");
  requireAngle("tolerance", tolerance, M_PI / 4.0, "(0, pi/4)");
  requireInRange("min_support", min_support, 0.0, 1.0);
  requireInRange("min_vertical", min_vertical, 0.0, 1.0);
  requireInRange("min_ground", min_ground, 0.0, 1.0);
  requireInRange("max_ambiguity", max_ambiguity, 0.0, 1.0);
}

Upright findUpright(const std::vector<PlaneSegment>& segments, const UprightParams& params) {
  params.validate();
  Upright result;
  const Vector3 level = params.expected_up.normalized();
  result.up = level;
  const std::vector<WeightedPlane> planes = largest(segments);
  const auto scoreOf = [&](const Vector3& up) {
    const double tilts = angleBetween(up, level) / params.usual_tilt;
    return supportOf(up, planes, params.tolerance).total() * std::exp(-0.5 * tilts * tilts);
  };
  const std::vector<Vector3> directions = candidates(planes, level, params.max_tilt);
  double best_score = scoreOf(level);
  Vector3 best = level;
  for (const Vector3& up : directions) {
    const double score = scoreOf(up);
    if (score > best_score) {
      best = up;
      best_score = score;
    }
  }
  const Support support = supportOf(best, planes, params.tolerance);
  result.horizontal = support.horizontal;
  result.vertical = support.vertical;
  const bool confirmed =
      support.vertical >= params.min_vertical || support.ground >= params.min_ground;
  if (!confirmed || !(support.total() >= params.min_support)) return result;
  for (const Vector3& up : directions) {
    if (angleBetween(up, best) > kSameDirection && scoreOf(up) > params.max_ambiguity * best_score)
      return result;
  }
  const Vector3 up = fitted(best, planes, params.tolerance);
  const double tilt = angleBetween(up, level);
  if (tilt <= params.level_tolerance || tilt > params.max_tilt) return result;
  result.found = true;
  result.up = up;
  result.tilt = tilt;
  return result;
}

Upright findUpright(const PointsView& points, const std::optional<StereoNoise>& noise,
                    const Vector3& expected_up) {
  constexpr double kThreshold = 0.03;
  constexpr std::size_t kMinFraction = 300;  // as of multi_plane_segmentation
  constexpr std::size_t kMinInliers = 100;
  if (points.size == 0) return {};
  MultiPlaneParams plane_params;
  plane_params.distance_threshold = kThreshold;
  plane_params.min_inliers =
      static_cast<int>(std::max(kMinInliers, usablePoints(points).size() / kMinFraction));
  plane_params.noise = noise;
  UprightParams params;
  params.expected_up = expected_up;
  return findUpright(findPlanes(points, nullptr, plane_params).planes, params);
}

}  // namespace planar_mapping
