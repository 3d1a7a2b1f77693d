// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/ground/up.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/geometry/cloud_scale.h"

namespace planar_mapping {
namespace {

constexpr std::size_t kMaxPlanes = 20;
/// Planes that meet at a smaller angle do not fix the line in which they meet: its sine.
constexpr double kMinMeeting = 0.5;
/// Directions closer together than this are the same one, seen with different errors.
constexpr double kSameDirection = 10.0 * M_PI / 180.0;
constexpr double kMaxTilt = 65.0 * M_PI / 180.0;
/// Tilted by more, something horizontal has to be below the sensor: a camera that looks down at a
/// floor before a wall sees what another that looks up at a ceiling sees.
constexpr double kMaxTiltWithoutGround = 25.0 * M_PI / 180.0;
/// Standard deviation of the tilt: of directions that explain the planes alike, the one nearer to
/// level is taken.
constexpr double kUsualTilt = 30.0 * M_PI / 180.0;
constexpr double kLevelTolerance = M_PI / 180.0;   ///< a smaller tilt is none
constexpr double kTolerance = 4.0 * M_PI / 180.0;  ///< of what is horizontal or vertical
// Fractions of the points on planes.
constexpr double kMinSupport = 0.7;   ///< that must be horizontal or vertical
constexpr double kMinVertical = 0.1;  ///< that must be vertical; below it, ...
constexpr double kMinGround = 0.5;    ///< ... that must be on one horizontal plane below the sensor
constexpr double kMinBelow = 0.05;    ///< the same where the sensor is tilted far
/// Images of all poses have upwards closer to z than this where the world is z up: a camera that
/// looks down at a table has 70 degrees, one of a level world with z forwards 79 and more.
constexpr double kMaxViewTilt = 75.0 * M_PI / 180.0;
/// A world leans whose vertical is farther from an axis: poses and planes are off by less.
constexpr double kMinLean = 5.0 * M_PI / 180.0;
/// The same where the images say that z is upwards: far planes of a pair are off by more.
constexpr double kMinLeanOfZ = 10.0 * M_PI / 180.0;
/// Where another direction is as likely as this fraction of the best one, neither is taken.
constexpr double kMaxAmbiguity = 0.7;

struct WeightedPlane {
  Plane plane;
  double weight = 0.0;  ///< fraction of the points on planes
};

struct Support {
  double horizontal = 0.0;
  double vertical = 0.0;
  double ground = 0.0;  ///< the largest horizontal plane below the sensor
  double below = 0.0;   ///< all horizontal planes below the sensor
  double total() const { return horizontal + vertical; }
};

Support supportOf(const Vector3& up, const std::vector<WeightedPlane>& planes) {
  Support support;
  for (const WeightedPlane& one : planes) {
    const double along = up.dot(one.plane.normal);
    if (std::abs(along) > std::cos(kTolerance)) {
      support.horizontal += one.weight;
      const double height = along * one.plane.signedDistance(Vector3::Zero());
      if (height <= 0.0) continue;
      support.ground = std::max(support.ground, one.weight);
      support.below += one.weight;
    } else if (std::abs(along) < std::sin(kTolerance)) {
      support.vertical += one.weight;
    }
  }
  return support;
}

/// Whether planes of one direction, most of all, might be horizontal as well as the walls they are
/// taken for.
bool mayBeFloors(const Support& support, const std::vector<WeightedPlane>& planes) {
  if (support.horizontal >= kMinVertical) return false;
  return std::any_of(planes.begin(), planes.end(), [&](const WeightedPlane& one) {
    return supportOf(one.plane.normal, planes).below >= kMinGround;
  });
}

/// The direction next to all that is horizontal or vertical, least squares of the angles; \p up
/// where a single wall leaves it open.
Vector3 fitted(const Vector3& up, const std::vector<WeightedPlane>& planes) {
  constexpr double kMinFraction = 0.03;  // of the planes that must hold each turn
  Matrix3 sum = Matrix3::Zero();
  for (const WeightedPlane& one : planes) {
    const Vector3& n = one.plane.normal;
    const double along = std::abs(up.dot(n));
    if (along > std::cos(kTolerance)) {
      sum += one.weight * (Matrix3::Identity() - n * n.transpose());
    } else if (along < std::sin(kTolerance)) {
      sum += one.weight * n * n.transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(sum);
  if (!(solver.eigenvalues()[1] > kMinFraction * sum.trace())) return up;
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
  if (result.size() > kMaxPlanes) result.resize(kMaxPlanes);
  double sum = 0.0;
  for (const WeightedPlane& one : result) sum += one.weight;
  for (WeightedPlane& one : result) one.weight /= sum;
  return result;
}

/// Directions upwards that the planes could mean, within the largest tilt.
std::vector<Vector3> candidates(const std::vector<WeightedPlane>& planes, const Vector3& level) {
  std::vector<Vector3> result;
  const auto add = [&](const Vector3& direction) {
    const Vector3 up = direction.dot(level) < 0.0 ? Vector3(-direction) : direction;
    if (angleBetween(up, level) <= kMaxTilt) result.push_back(up);
  };
  for (std::size_t i = 0; i < planes.size(); ++i) {
    add(planes[i].plane.normal);
    for (std::size_t j = 0; j < i; ++j) {
      const Vector3 line = planes[i].plane.normal.cross(planes[j].plane.normal);
      if (line.norm() > kMinMeeting) add(line.normalized());
    }
  }
  return result;
}

/// The direction upwards by all that is horizontal or vertical.
Upright uprightOf(const std::vector<WeightedPlane>& planes, const Vector3& level) {
  Upright result;
  result.up = level;
  const auto scoreOf = [&](const Vector3& up) {
    const double tilt = angleBetween(up, level);
    const Support support = supportOf(up, planes);
    if (tilt > kMaxTiltWithoutGround && support.ground < kMinBelow) return 0.0;
    return support.total() * std::exp(-0.5 * tilt * tilt / (kUsualTilt * kUsualTilt));
  };
  const std::vector<Vector3> directions = candidates(planes, level);
  double best_score = scoreOf(level);
  Vector3 best = level;
  for (const Vector3& up : directions) {
    const double score = scoreOf(up);
    if (score > best_score) {
      best = up;
      best_score = score;
    }
  }
  const Support support = supportOf(best, planes);
  result.horizontal = support.horizontal;
  result.vertical = support.vertical;
  result.is_uncertain = mayBeFloors(support, planes);
  const bool confirmed = support.vertical >= kMinVertical || support.ground >= kMinGround;
  if (!confirmed || !(support.total() >= kMinSupport)) return result;
  for (const Vector3& up : directions) {
    if (angleBetween(up, best) > kSameDirection && scoreOf(up) > kMaxAmbiguity * best_score)
      return result;
  }
  const Vector3 up = fitted(best, planes);
  const double tilt = angleBetween(up, level);
  if (tilt <= kLevelTolerance || tilt > kMaxTilt) return result;
  result.found = true;
  result.up = up;
  result.tilt = tilt;
  return result;
}

}  // namespace

Upright findUpright(const std::vector<PlaneSegment>& segments, const Vector3& expected_up) {
  if (!expected_up.allFinite() || !(expected_up.norm() > 0.0)) {
    throw ParameterError("expected_up", expected_up.norm(), "finite, not zero");
  }
  return uprightOf(largest(segments), expected_up.normalized());
}

std::vector<PlaneSegment> planesFor(const PointsView& points,
                                    const std::optional<StereoNoise>& noise) {
  constexpr double kThreshold = 0.03;
  constexpr std::size_t kMinFraction = 300;  // as of multi_plane_segmentation
  constexpr std::size_t kMinInliers = 100;
  const Indices usable = usablePoints(points);
  MultiPlaneParams params;
  params.distance_threshold = kThreshold;
  params.min_inliers = static_cast<int>(std::max(kMinInliers, usable.size() / kMinFraction));
  params.noise = noise;
  return findPlanes(points, &usable, params).planes;
}

WorldUp upOf(const Vector3& image_axis, const std::optional<ImagesUp>& images,
             const Pose& T_world_sensor, const std::vector<PlaneSegment>& planes) {
  const Vector3 z = Vector3::UnitZ();
  const bool is_z =
      images && !images->starts_at_identity && angleBetween(images->mean, z) < kMaxViewTilt;
  const Vector3 axis = is_z ? z : nearestAxis(images ? images->mean : image_axis);
  const Matrix3 axes = T_world_sensor.linear();
  const Vector3 expected = is_z || !images ? axis : images->mean;
  const Upright seen = findUpright(planes, axes.transpose() * expected);
  const bool sees_both = seen.horizontal >= kMinVertical && seen.vertical >= kMinVertical;
  if (!seen.found || (is_z && !sees_both)) return {axis, false, false};
  const Vector3 up = axes * seen.up;
  const Vector3 nearest = is_z ? z : nearestAxis(up);
  if (angleBetween(up, nearest) < (is_z ? kMinLeanOfZ : kMinLean))
    return {nearest, false, seen.is_uncertain && nearest != axis};
  return {up, true, seen.is_uncertain};
}

}  // namespace planar_mapping
