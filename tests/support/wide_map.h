// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/map/file/map_record.h"

namespace planar_mapping::test {

/// The file of a map that knows nothing but free space: side^3 cubes of 32 x 32 x 32 cells of 0.1
/// m, every \p step-th along each axis. Up to 55^3 take less than 3 kB.
inline std::vector<std::uint8_t> wideMap(std::int32_t side, std::int32_t step = 1,
                                         double timestamp = 0.0) {
  PlanarMapParams params;
  params.approximation.resolution = 0.1;
  detail::MapData map(params);
  map.trajectory.push_back({timestamp, Vector3::Zero(), Quaternion::Identity()});
  const std::int32_t last = side - 1;
  detail::forEachPlace({0, 0, 0}, {last, last, last}, [&](const detail::Int3& at) {
    map.space.setRegion({step * at.x, step * at.y, step * at.z},
                        detail::SpaceRegion::allOf(detail::SpaceRegion::kFree));
  });
  map.commit();
  return detail::serializeMap(detail::recordOf(map, {}));
}

/// The file of a finished map: a layer of cubes that are free, cut by one thin cuboid.
inline std::vector<std::uint8_t> cutMap(std::int32_t side) {
  detail::MapData map;
  const double length = 32.0 * map.resolution() * side;
  detail::forEachPlace({0, 0, 0}, {side - 1, side - 1, 0}, [&](const detail::Int3& at) {
    map.space.setRegion(at, detail::SpaceRegion::allOf(detail::SpaceRegion::kFree));
  });
  Cuboid cuboid;
  cuboid.center = Vector3(0.5 * length, 0.5 * length, 1.0);
  cuboid.size = Vector3(length, length, 0.02);
  return detail::serializeMap(detail::finishedRecordOf(map, {cuboid}));
}

}  // namespace planar_mapping::test
