// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The core library alone: no PCL, only Eigen.
#include <cstdio>
#include <vector>

#include "planar_mapping/core/cuboids/cuboid_approximation.h"
#include "planar_mapping/core/planes/multi_plane.h"

int main() {
  std::vector<float> xyz;  // a wall of 2 m x 1 m, 2 m ahead
  for (int i = 0; i < 200; ++i) {
    for (int j = 0; j < 100; ++j)
      xyz.insert(xyz.end(), {0.01f * i + 0.005f, 0.01f * j + 0.005f, 2.0f});
  }
  const planar_mapping::PointsView points(xyz.data(), xyz.size() / 3);

  const auto found =
      planar_mapping::findPlanes(points, nullptr, planar_mapping::MultiPlaneParams());
  planar_mapping::CuboidApproximationParams params;
  params.up = -planar_mapping::Vector3::UnitY();
  const auto cuboids = planar_mapping::approximateCuboids(points, nullptr, found.planes, params);

  std::printf("%zu plane, %zu cuboid\n", found.planes.size(), cuboids.size());
}
