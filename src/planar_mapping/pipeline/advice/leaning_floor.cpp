// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/advice/leaning_floor.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "planar_mapping/geometry/angles.h"

namespace planar_mapping::detail {

namespace {

constexpr double kLevel = 5.0 * kRadiansPerDegree;   // is level, or as good
constexpr double kSteep = 45.0 * kRadiansPerDegree;  // is no floor in any case

using Areas = std::map<std::int32_t, double>;

double angleTo(const Vector3& axis, const Plane& plane) {
  return std::acos(std::min(1.0, std::abs(plane.normal.dot(axis))));
}

/// What is level for the sensor, where poses turn clouds and do not move them.
std::optional<Vector3> upOfSensor(const PlanarMap& map, const Vector3& up) {
  if (map.trajectory().empty()) return std::nullopt;
  const Vector3 own = map.trajectory().front().second.linear().col(2);
  for (const auto& [time, pose] : map.trajectory()) {
    if (!pose.translation().isZero(0.0) || !pose.linear().col(2).isApprox(own)) return std::nullopt;
  }
  if (own.dot(up) > std::cos(kSteep)) return std::nullopt;
  return own;
}

/// The axis of the world that nearly all planes face along, where none is level. One plane may be a
/// wall that was cut out, and a scan in a corridor may see both walls and no floor.
std::optional<LeaningFloor> otherAxis(const PlanarMap& map, const Areas& areas, double all,
                                      const Vector3& up) {
  constexpr double kAlong = 0.95;     // cosine
  constexpr double kMaxLevel = 0.02;  // fractions of the area
  constexpr double kMinOther = 0.95;
  constexpr double kMinAreaOfMap = 10.0;  // m2; less is an object
  if (map.params().unknown_space || all < kMinAreaOfMap) return std::nullopt;
  const auto areaAlong = [&](const Vector3& axis, int& planes) {
    double sum = 0.0;
    planes = 0;
    for (const MapPlane& seen : map.planes()) {
      const auto area = areas.find(seen.id);
      const bool counts = std::abs(seen.plane.normal.dot(axis)) > kAlong;
      if (!counts || area == areas.end()) continue;
      sum += area->second;
      ++planes;
    }
    return sum;
  };
  int planes = 0;
  if (areaAlong(up, planes) >= kMaxLevel * all) return std::nullopt;
  for (int i = 0; i < 3; ++i) {
    const Vector3 axis = Vector3::Unit(i);
    const double area = areaAlong(axis, planes);
    if (planes > 1 && area > kMinOther * all && std::abs(axis.dot(up)) < std::cos(kSteep))
      return LeaningFloor{area, std::acos(std::abs(axis.dot(up))), LeaningFloor::Kind::OtherAxis,
                          axis};
  }
  return std::nullopt;
}

}  // namespace

std::optional<LeaningFloor> leaningFloor(const PlanarMap& map, bool is_camera) {
  constexpr double kTotalFraction = 0.2;
  constexpr double kFloorFraction = 0.5;
  constexpr double kMinArea = 1.0;  // m2
  Areas areas;
  double all = 0.0;
  for (const Cuboid& cuboid : map.cuboids()) {
    if (cuboid.plane_id < 0) continue;
    const double area = cuboid.size.x() * cuboid.size.y();
    areas[cuboid.plane_id] += area;
    all += area;
  }
  const Vector3 up = map.params().approximation.up.normalized();
  const std::optional<Vector3> own = is_camera ? std::nullopt : upOfSensor(map, up);
  const auto isBelow = [&map](const Plane& plane, const Vector3& axis) {
    const double sign = plane.normal.dot(axis) < 0.0 ? -1.0 : 1.0;
    return std::all_of(map.trajectory().begin(), map.trajectory().end(), [&](const auto& stamped) {
      return sign * plane.signedDistance(stamped.second.translation()) > 0.0;
    });
  };
  LeaningFloor largest;
  double level = 0.0;
  for (const MapPlane& seen : map.planes()) {
    const double tilt = angleTo(up, seen.plane);
    const double area = areas[seen.id];
    if (tilt <= kLevel) {
      level = std::max(level, area);
    } else if (area > largest.area && tilt < kSteep && isBelow(seen.plane, up)) {
      const double sign = seen.plane.normal.dot(up) < 0.0 ? -1.0 : 1.0;
      largest = {area, tilt, LeaningFloor::Kind::Leans, sign * seen.plane.normal};
    } else if (area > largest.area && own && angleTo(*own, seen.plane) <= kLevel &&
               isBelow(seen.plane, *own)) {
      largest = {area, tilt, LeaningFloor::Kind::LevelWithoutTurn, *own};
    }
  }
  const bool counts = largest.area >= std::max(kMinArea, kTotalFraction * all);
  if (counts && level < kFloorFraction * largest.area) return largest;
  return is_camera ? std::nullopt : otherAxis(map, areas, all, up);
}

}  // namespace planar_mapping::detail
