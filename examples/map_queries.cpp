// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Asks a map what a planner asks: map_queries [MAP.pmap]. Without a file it maps a wall.
#include <cstdio>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/export/map_export.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/map/map_query.h"
#include "planar_mapping/planes/multi_plane.h"

using namespace planar_mapping;

/// A wall of 2 m x 1 m, 2 m ahead of a camera at the origin.
PlanarMap mapOfWall() {
  std::vector<float> xyz;
  for (int i = 0; i < 200; ++i) {
    for (int j = 0; j < 100; ++j)
      xyz.insert(xyz.end(), {0.01f * i - 0.995f, 0.01f * j - 0.495f, 2.0f});
  }
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), xyz.size() / 3);
  const auto found = findPlanes(frame.points, nullptr, MultiPlaneParams());
  frame.planes = &found.planes;
  PlanarMapParams params;
  params.approximation.resolution = 0.1;        // metres
  params.approximation.up = -Vector3::UnitY();  // y is down in a camera's frame
  PlanarMap map(params);
  map.insert(frame);
  return map;
}

int main(int argc, char** argv) try {
  const PlanarMap map = argc > 1 ? io::loadMap(argv[1]) : mapOfWall();

  const bool occupied = map.isOccupied({0.0, 0.0, 2.02});
  const auto hit = castRay(map, Vector3::Zero(), Vector3::UnitZ(), 10.0);  // metres
  const BoxState ahead = stateOfBox(map, {-0.3, -0.3, 0.5}, {0.3, 0.3, 1.5});
  for (const Cuboid& cuboid : map.cuboids()) {
    std::printf("plane %d, %.2f x %.2f x %.2f m\n", cuboid.plane_id, cuboid.size.x(),
                cuboid.size.y(), cuboid.size.z());
  }

  std::printf("occupied: %d, a ray ends after %.1f m, the way ahead is %s\n", occupied,
              hit ? hit->distance : 0.0, ahead.state == CellState::Free ? "free" : "not free");
  if (argc > 2) io::exportMap(map, argv[2]);  // csv, json, obj, ply, sdf, ...
} catch (const planar_mapping::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
