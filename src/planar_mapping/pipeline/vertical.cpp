// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/vertical.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/ground/upright.h"
#include "planar_mapping/pipeline/rounded.h"

namespace planar_mapping::detail {
namespace {

/// Poses given for a camera may be of a world that is not level, as that of a first camera: then
/// planes tell what is upwards, unless they come near an axis. Where z is upwards in the images
/// of a pair of cameras, on the mean of all, it was made so: their far planes are off by degrees.
void findVerticalOfCamera(const std::optional<Vector3>& mean_up, CloudScale& scale, Frame& frame) {
  constexpr double kAxis = 5.0 * kRadiansPerDegree;
  constexpr double kNearAxis = 15.0 * kRadiansPerDegree;  // of the mean of many images
  constexpr double kLevel = 2.0 * kRadiansPerDegree;      // likewise
  if (mean_up) scale.up = nearestAxis(*mean_up);
  if (!frame.camera) return;
  if (frame.baseline && mean_up && angleBetween(Vector3::UnitZ(), *mean_up) < kLevel) return;
  const Matrix3 axes = frame.T_world_sensor.linear();
  Vector3 expected = axes.transpose() * scale.up;
  std::optional<Vector3> z;  // cameras that look steeply down have upwards of images next to others
  if (mean_up && angleBetween(scale.up, *mean_up) > kNearAxis) {
    expected = axes.transpose() * *mean_up;
    z = axes.transpose() * Vector3::UnitZ();
  }
  const Upright upright = findUpright(pointsOf(*frame.cloud), scale.stereo, expected, z);
  if (!upright.found) return;
  const Vector3 up = axes * upright.up;
  const Vector3 axis = nearestAxis(up);
  const bool is_axis = angleBetween(axis, up) < kAxis;
  scale.up = is_axis ? axis : up;
  const std::string by_planes = "by the planes seen `up: auto` is " + rounded(scale.up, 3);
  if (upright.is_uncertain) {
    const bool is_floor = upright.horizontal > upright.vertical;
    frame.warnings.push_back(frame.source + ": " + by_planes + ", if what it looks at is a " +
                             (is_floor ? "floor or a table" : "wall") + "; if it is a " +
                             (is_floor ? "wall" : "floor or a table") + ", set `up` of the stages");
  } else if (!is_axis) {
    frame.notes.push_back(frame.source + ": the world of the given poses is not level; " +
                          by_planes);
  }
}

double reachAlongZ(const PointsView& points, const Indices& indices) {
  double low = INFINITY, high = -INFINITY;
  for (const int i : indices) {
    const double z = points.point(static_cast<std::size_t>(i)).z();
    low = std::min(low, z);
    high = std::max(high, z);
  }
  return high - low;
}

/// Maps of cameras and some of lidars have y upwards or downwards: there nearly all that is planar
/// faces along another axis, and reaches farther along z than any wall.
void findVerticalOfMap(CloudScale& scale, Frame& frame) {
  constexpr double kAlong = 0.98;           // cosine
  constexpr double kMinFraction = 0.5;      // of the points on planes
  constexpr double kMaxLevel = 0.1;         // times that
  constexpr double kHighestWall = 50.0;     // metres
  constexpr std::size_t kMinInliers = 300;  // th part of the points
  const PointsView points = pointsOf(*frame.cloud);
  // Planes are looked for only where one could reach that far.
  if (reachAlongZ(points, frame.indices) < kHighestWall) return;
  MultiPlaneParams params;
  params.distance_threshold = 0.5 * automaticResolution(scale);
  params.min_inliers = static_cast<int>(std::max<std::size_t>(3, scale.points / kMinInliers));
  const std::vector<PlaneSegment> planes = findPlanes(points, &frame.indices, params).planes;
  Vector3 along = Vector3::Zero();
  double all = 0.0;
  const PlaneSegment* largest = nullptr;
  for (const PlaneSegment& segment : planes) {
    const auto size = static_cast<double>(segment.inliers.size());
    all += size;
    if (largest == nullptr || size > static_cast<double>(largest->inliers.size()))
      largest = &segment;
    for (int i = 0; i < 3; ++i)
      if (std::abs(segment.plane.normal[i]) > kAlong) along[i] += size;
  }
  Eigen::Index axis = 0;
  if (!(along.maxCoeff(&axis) > kMinFraction * all) || axis == 2 ||
      along.z() > kMaxLevel * along[axis] || std::abs(largest->plane.normal[axis]) <= kAlong) {
    return;
  }
  const double reach = reachAlongZ(points, largest->inliers);
  if (reach < kHighestWall) return;
  // What is built on the ground is over it.
  std::ptrdiff_t over = 0;
  for (const int i : frame.indices) {
    const double side = largest->plane.signedDistance(points.point(static_cast<std::size_t>(i)));
    if (std::abs(side) > params.distance_threshold) over += side > 0.0 ? 1 : -1;
  }
  const bool with_normal = over >= 0;
  scale.up = nearestAxis(with_normal ? largest->plane.normal : Vector3(-largest->plane.normal));
  frame.warnings.push_back(frame.source + ": nearly all planes face along another axis than z, " +
                           rounded(reach, 0) + " m along z: `up: auto` is " + rounded(scale.up, 3) +
                           "; if they are walls, set `up` of the stages");
}

}  // namespace

void findVertical(const std::optional<Vector3>& mean_up, CloudScale& scale, Frame& frame) {
  if (!scale.has_sensor) {
    if (frame.T_world_sensor.linear().isIdentity(0.0)) findVerticalOfMap(scale, frame);
  } else if (frame.starts_world) {
    // Made level, but for `start: identity`.
    if (!frame.T_world_sensor.linear().isIdentity(0.0)) scale.up = Vector3::UnitZ();
  } else if (scale.optical && frame.given_pose) {
    findVerticalOfCamera(mean_up, scale, frame);
  }
}

}  // namespace planar_mapping::detail
