// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Core and map alone: no PCL, only Eigen.
#include <cstdio>
#include <vector>

#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/planes/multi_plane.h"

int main() {
  std::vector<float> xyz;  // a wall of 2 m x 1 m, 2 m ahead
  for (int i = 0; i < 200; ++i) {
    for (int j = 0; j < 100; ++j)
      xyz.insert(xyz.end(), {0.01f * i + 0.005f, 0.01f * j + 0.005f, 2.0f});
  }
  planar_mapping::FrameObservation frame;
  frame.points = planar_mapping::PointsView(xyz.data(), xyz.size() / 3);
  const auto found = planar_mapping::findPlanes(frame.points, nullptr, {});
  frame.planes = &found.planes;

  planar_mapping::PlanarMapParams params;
  params.approximation.up = -planar_mapping::Vector3::UnitY();
  planar_mapping::PlanarMap map(params);
  map.insert(frame);

  std::printf("%zu plane, %zu cuboid\n", found.planes.size(), map.cuboids().size());
}
