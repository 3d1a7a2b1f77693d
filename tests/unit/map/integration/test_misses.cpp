// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/map/planar_map.h"
#include "ring_scan.h"

namespace planar_mapping {
namespace {

/// Of 16 rings a third of the pixels of a room are measured: a wrong point in its middle, seen
/// once, is passed between them, while nothing of walls, floor and ceiling goes.
TEST(Misses, WrongPointsAreLostBetweenTheRingsOfAScanner) {
  Random random(5);
  const Vector3 wrong(0.5, 0.3, 0.05);
  PlanarMap map;
  std::vector<Vector3> first;
  for (int i = 0; i < 9; ++i) {
    const double a = 2.0 * M_PI * i / 9.0;
    Pose pose = Pose::Identity();
    pose.translation() << 2.2 * std::cos(a), 1.6 * std::sin(a), 0.1 * std::sin(3.0 * a);
    const Eigen::Array3d at = pose.translation().array();
    std::vector<float> xyz = test::ringScan(Eigen::Array3d(-4.0, -3.0, -1.1) - at,
                                            Eigen::Array3d(4.0, 3.0, 1.9) - at, 0.0, 0.01, random);
    if (i == 0) {
      for (std::size_t k = 0; k < xyz.size(); k += 3)
        first.push_back(pose * Vector3(xyz[k], xyz[k + 1], xyz[k + 2]));
      const Eigen::Vector3f p = (pose.inverse() * wrong).cast<float>();
      std::copy_n(p.data(), 3, xyz.begin());
    }
    FrameObservation frame;
    frame.points = PointsView(xyz.data(), xyz.size() / 3);
    frame.T_world_sensor = pose;
    map.insert(frame);
    ASSERT_TRUE(i > 0 || !map.cuboidsAt(wrong, 0.05).empty());
  }
  EXPECT_TRUE(map.cuboidsAt(wrong, 0.05).empty());
  EXPECT_EQ(map.stateAt(wrong), CellState::Free);
  std::size_t lost = 0;
  for (const Vector3& point : first) lost += map.cuboidsAt(point, 0.05).empty() ? 1 : 0;
  EXPECT_LT(static_cast<double>(lost), 0.002 * static_cast<double>(first.size()));
}

/// Edges leave points in the air, one of a hundred here, in every scan: they neither hide each other
/// from the rays that pass them nor become cells where a surface would have many points.
TEST(Misses, StrayPointsOfManyScansAreFew) {
  Random random(6);
  PlanarMap map;
  std::size_t strays = 0;
  const Eigen::Array3d low(-4.0, -3.0, -1.1), high(4.0, 3.0, 1.9);
  for (int i = 0; i < 9; ++i) {
    const double a = 2.0 * M_PI * i / 9.0;
    Pose pose = Pose::Identity();
    pose.translation() << 2.2 * std::cos(a), 1.6 * std::sin(a), 0.0;
    const Eigen::Array3d at = pose.translation().array();
    std::vector<float> xyz = test::boxScan(low - at, high - at, 40.0);
    for (std::size_t k = 0; k < xyz.size(); k += 3) {
      if (random.uniform() > 0.01) continue;
      const auto part = static_cast<float>(0.4 + 0.4 * random.uniform());
      for (std::size_t axis = 0; axis < 3; ++axis) xyz[k + axis] *= part;
      ++strays;
    }
    FrameObservation frame;
    frame.points = PointsView(xyz.data(), xyz.size() / 3);
    frame.T_world_sensor = pose;
    map.insert(frame);
  }
  std::size_t left = 0;  // away from all walls
  for (const Cuboid& cuboid : map.cuboids()) {
    const Eigen::Array3d c = cuboid.center.array();
    left += (c > low + 0.2).all() && (c < high - 0.2).all() ? 1 : 0;
  }
  EXPECT_GT(strays, 4000u);
  EXPECT_LT(left, 600u);
}

}  // namespace
}  // namespace planar_mapping
