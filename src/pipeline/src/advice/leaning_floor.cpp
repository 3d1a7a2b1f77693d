// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "advice/leaning_floor.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "planar_mapping/core/geometry/detail/angles.h"

namespace planar_mapping::detail {

std::optional<LeaningFloor> leaningFloor(const PlanarMap& map) {
  constexpr double kLevel = 5.0 * kRadiansPerDegree;   // is level, or as good
  constexpr double kSteep = 45.0 * kRadiansPerDegree;  // is no floor in any case
  constexpr double kTotalFraction = 0.2;
  constexpr double kFloorFraction = 0.5;
  constexpr double kMinArea = 1.0;  // m2
  std::map<std::int32_t, double> areas;
  double all = 0.0;
  for (const Cuboid& cuboid : map.cuboids()) {
    if (cuboid.plane_id < 0) continue;
    const double area = cuboid.size.x() * cuboid.size.y();
    areas[cuboid.plane_id] += area;
    all += area;
  }
  const Vector3 up = map.params().approximation.up.normalized();
  const auto isBelow = [&map, &up](const Plane& plane) {
    const double sign = plane.normal.dot(up) < 0.0 ? -1.0 : 1.0;
    return std::all_of(map.trajectory().begin(), map.trajectory().end(), [&](const auto& stamped) {
      return sign * plane.signedDistance(stamped.second.translation()) > 0.0;
    });
  };
  LeaningFloor largest;
  double level = 0.0;
  for (const MapPlane& seen : map.planes()) {
    const double tilt = std::acos(std::min(1.0, std::abs(seen.plane.normal.dot(up))));
    const double area = areas[seen.id];
    if (tilt <= kLevel) {
      level = std::max(level, area);
    } else if (tilt < kSteep && area > largest.area && isBelow(seen.plane)) {
      largest = {area, tilt};
    }
  }
  const bool counts = largest.area >= std::max(kMinArea, kTotalFraction * all);
  if (!counts || level >= kFloorFraction * largest.area) return std::nullopt;
  return largest;
}

}  // namespace planar_mapping::detail
