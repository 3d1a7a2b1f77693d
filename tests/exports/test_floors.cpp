// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What of a map made by hand is floor in a plan, obstacle or drop.
#include "planar_mapping/io/export/floors.h"

#include <algorithm>

#include "export_scene.h"
#include "map_scene.h"

namespace planar_mapping {
namespace {

using test::box;
using test::numberPlanes;

TEST(NavigationMap, FloorsThatLeanAreNoObstacles) {
  io::ExportedMap map;
  map.resolution = 0.5;
  map.cuboids = {box({-3.0, -3.0, 0.5}, {3.0, 3.0, 0.6}), box({0.0, 0.0, 0.6}, {0.5, 0.5, 1.6})};
  map.cuboids[0].plane_id = 0;
  map.cuboids[0].orientation = Eigen::AngleAxisd(0.1, Vector3::UnitX());  // 0.3 m at its rim
  const io::OccupancyGrid grid = io::gridOf(map);
  EXPECT_NEAR(grid.ground, 0.6, 0.1) << "of a square of 2 m, which leans by 0.2 m";
  EXPECT_EQ(std::count(grid.values.begin(), grid.values.end(), io::OccupancyGrid::kOccupied), 1);
  map.options.band.low = -0.2;  // who asks for the floor gets it
  const io::OccupancyGrid all = io::gridOf(map);
  EXPECT_GT(std::count(all.values.begin(), all.values.end(), io::OccupancyGrid::kOccupied), 100);
}

TEST(NavigationMap, FloorsGoOnUpARampButNotUpAStep) {
  io::ExportedMap map;
  map.resolution = 0.5;
  map.cuboids = {box({-3.0, -3.0, -0.1}, {3.0, 3.0, 0.0})};
  for (int i = 0; i < 6; ++i) {  // faces of 2 m that rise by 0.1 m each
    const double low = 3.0 + 2.0 * i;
    Cuboid face = box({low, -1.0, 0.1 * i - 0.05}, {low + 2.0, 1.0, 0.1 * i + 0.05});
    face.orientation = Eigen::AngleAxisd(-std::atan(0.05), Vector3::UnitY());
    face.center.z() += 0.05;
    map.cuboids.push_back(face);
  }
  map.cuboids.push_back(box({-3.0, 3.0, 0.2}, {3.0, 5.0, 0.3}));  // a step of 0.3 m
  numberPlanes(map);
  const io::Floors floors(map.cuboids, {}, io::GroundHeights(0.0), 0.15, map.resolution);
  for (std::size_t i = 0; i < map.cuboids.size(); ++i) EXPECT_EQ(i < 7, floors.contains(i)) << i;
  const io::OccupancyGrid grid = io::gridOf(map);
  EXPECT_EQ(std::count(grid.values.begin(), grid.values.end(), io::OccupancyGrid::kOccupied),
            12 * 4);
}

TEST(NavigationMap, FollowsAFloorThatSinksUnderALintel) {
  io::ExportedMap map;  // poses drift by 0.4 m over 40 m; a lintel 2 m over the far end
  map.resolution = 0.5;
  for (int i = 0; i < 10; ++i) {
    const double height = -0.04 * i;
    map.cuboids.push_back(box({4.0 * i, 0.0, height - 0.1}, {4.0 * i + 4.0, 4.0, height}));
    map.cuboids.back().plane_id = i;
  }
  map.cuboids.push_back(box({36.0, 0.0, 1.64}, {36.5, 4.0, 2.5}));
  map.cuboids.push_back(box({20.0, 1.0, -0.2}, {20.5, 1.5, 0.1}));  // 0.3 m high
  const io::OccupancyGrid grid = io::gridOf(map);
  EXPECT_EQ(std::count(grid.values.begin(), grid.values.end(), io::OccupancyGrid::kOccupied), 1);
}

TEST(NavigationMap, AKerbIsNoRampBySlabsOnItsFace) {
  io::ExportedMap map;
  map.resolution = 0.1;
  map.cuboids = {box({0.0, 0.0, -0.1}, {10.0, 4.0, 0.0}),
                 box({0.0, 4.0, 0.0}, {10.0, 4.1, 0.1}),    // along the face of the kerb
                 box({0.0, 4.05, 0.1}, {10.0, 6.0, 0.2})};  // its top
  numberPlanes(map);
  EXPECT_FALSE(io::Floors(map.cuboids, {}, io::GroundHeights(0.0), 0.15, 0.1).contains(2));
}

/// A floor with a dais of 0.42 m, a ramp of 7 degrees to it and free space over all.
struct Dais {
  io::ExportedMap map;
  explicit Dais(double yaw) : turn(Eigen::AngleAxisd(yaw, Vector3::UnitZ())) {
    map.resolution = 0.1;
    add({-0.8, -4.0, -0.08}, {4.0, 4.0, 0.02});
    add({-4.0, -1.0, 0.34}, {-1.8, 3.0, 0.44});
    const double length = 0.42 / std::tan(0.12);
    add({-1.8, -1.0, 0.13}, {-1.8 + length, 0.2, 0.23}, 0.12);
    map.free = {box({-6.0, -6.0, 0.5}, {6.0, 6.0, 3.0}, CellState::Free)};
  }
  void add(const Vector3& low, const Vector3& high, double pitch = 0.0) {
    Cuboid face = box(low, high);
    face.center = turn * face.center;
    face.orientation = turn * Quaternion(Eigen::AngleAxisd(pitch, Vector3::UnitY()));
    face.plane_id = static_cast<std::int32_t>(map.cuboids.size());
    map.cuboids.push_back(face);
  }
  std::int8_t at(double x, double y) const {
    const io::OccupancyGrid grid = io::gridOf(map);
    const Vector3 p = turn * Vector3(x, y, 0.0);
    const Vector2 cell = (p.head<2>() - grid.origin) / grid.cell;
    return grid.at(static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y()));
  }
  Quaternion turn;
};

TEST(PlanFloors, ATableBesideADaisIsAnObstacleAtAnyYaw) {
  for (const double degrees : {0.0, 17.0, 30.0, 45.0}) {
    Dais dais(degrees * M_PI / 180.0);
    dais.add({-1.1, 1.4, 0.38}, {-0.1, 2.0, 0.48});
    EXPECT_EQ(io::OccupancyGrid::kOccupied, dais.at(-0.6, 1.7)) << degrees;
    EXPECT_EQ(io::OccupancyGrid::kFree, dais.at(-3.0, 1.0)) << degrees;
    for (const double x : {-1.5, -0.8, -0.1, 0.6, 1.3})
      EXPECT_EQ(io::OccupancyGrid::kFree, dais.at(x, -0.4)) << degrees << " degrees, " << x;
  }
}

TEST(PlanFloors, WhatHasFreeSpaceUnderItIsATable) {
  Dais dais(0.3);
  dais.add({-1.8, 1.4, 0.36}, {-0.8, 2.4, 0.46});  // touches the dais
  EXPECT_EQ(io::OccupancyGrid::kFree, dais.at(-1.3, 1.9));
  dais.map.free.push_back(box({-6.0, -6.0, 0.1}, {6.0, 6.0, 0.3}, CellState::Free));
  EXPECT_EQ(io::OccupancyGrid::kOccupied, dais.at(-1.3, 1.9));
}

TEST(PlanFloors, AStepIsNoHigherThanTheBandBegins) {
  Dais dais(0.0);
  dais.add({1.5, 1.0, 0.07}, {2.7, 1.8, 0.15});  // a plate 0.12 m high
  EXPECT_EQ(io::OccupancyGrid::kFree, dais.at(2.1, 1.4));
  dais.map.options.band.low = 0.1;
  EXPECT_EQ(io::OccupancyGrid::kOccupied, dais.at(2.1, 1.4));
}

TEST(PlanFloors, DropsAreUnknown) {
  io::ExportedMap map;  // a floor with a hole, stairs down in it, and free space over all
  map.resolution = 0.1;
  map.cuboids = {box({0.0, 0.0, -0.1}, {8.0, 3.0, 0.0}), box({0.0, 5.0, -0.1}, {8.0, 8.0, 0.0}),
                 box({0.0, 3.0, -0.1}, {3.0, 5.0, 0.0})};
  for (int i = 0; i < 10; ++i)
    map.cuboids.push_back(
        box({3.0 + 0.3 * i, 3.0, -0.27 - 0.17 * i}, {3.3 + 0.3 * i, 5.0, -0.17 * (i + 1)}));
  numberPlanes(map);
  map.free = {box({0.0, 0.0, 0.0}, {8.0, 8.0, 3.0}, CellState::Free),
              box({3.6, 3.0, -0.4}, {8.0, 5.0, 0.0}, CellState::Free)};
  const io::OccupancyGrid grid = io::gridOf(map);
  EXPECT_EQ(io::OccupancyGrid::kFree, grid.at(15, 40));
  EXPECT_EQ(io::OccupancyGrid::kFree, grid.at(60, 15));
  EXPECT_EQ(io::OccupancyGrid::kFree, grid.at(60, 65));
  for (const std::uint32_t x : {40u, 50u, 60u, 75u})
    EXPECT_EQ(io::OccupancyGrid::kUnknown, grid.at(x, 40)) << x;
}

TEST(PlanFloors, WhatACoverClosesOfAHoleIsADrop) {
  io::ExportedMap map;  // rectangles that leave a slit of 0.1 m of a hole of 0.4 m
  map.resolution = 0.1;
  map.cuboids = {box({0.0, 0.0, -0.1}, {1.9, 4.0, 0.0}), box({2.1, 0.0, -0.1}, {4.0, 4.0, 0.0}),
                 box({1.8, 0.0, -0.1}, {2.2, 1.95, 0.0}), box({1.8, 2.05, -0.1}, {2.2, 4.0, 0.0})};
  numberPlanes(map);
  map.free = {box({0.0, 0.0, 0.0}, {4.0, 4.0, 3.0}, CellState::Free)};
  const auto inHole = [](double at) { return at > 1.8 && at < 2.2; };
  const auto freeCells = [&] {
    const io::OccupancyGrid grid = io::gridOf(map);
    std::pair<int, int> count;  // over the hole, elsewhere
    for (std::uint32_t y = 0; y < grid.height; ++y) {
      for (std::uint32_t x = 0; x < grid.width; ++x) {
        const Vector2 place = grid.origin + grid.cell * Vector2(x + 0.5, y + 0.5);
        if (grid.at(x, y) != io::OccupancyGrid::kFree) continue;
        ++(inHole(place.x()) && inHole(place.y()) ? count.first : count.second);
      }
    }
    return count;
  };
  EXPECT_EQ(std::pair(16, 1584), freeCells()) << "that nobody looked into";
  map.free.push_back(box({1.8, 1.8, -1.0}, {2.2, 2.2, -0.1}, CellState::Free));
  EXPECT_EQ(std::pair(0, 1584 - 20), freeCells()) << "one cell around it";
}

TEST(PlanFloors, TheShadowUnderAnEdgeIsADrop) {
  io::ExportedMap map;  // a dock of two faces over a yard of which the first 0.7 m are not seen
  map.resolution = 0.1;
  map.cuboids = {box({0.0, 0.0, -0.1}, {4.0, 1.9, 0.0}), box({0.0, 2.0, -0.1}, {4.0, 4.0, 0.0}),
                 box({4.7, 0.0, -1.2}, {8.0, 4.0, -1.1})};
  numberPlanes(map);
  map.free = {box({0.0, 0.0, 0.0}, {8.0, 4.0, 3.0}, CellState::Free),
              box({4.7, 0.0, -1.1}, {8.0, 4.0, 0.0}, CellState::Free)};
  map.options.band.ground = 0.0;
  const io::OccupancyGrid grid = io::gridOf(map);
  EXPECT_EQ(io::OccupancyGrid::kFree, grid.at(38, 20));
  EXPECT_EQ(io::OccupancyGrid::kFree, grid.at(36, 19)) << "between the faces";
  for (const std::uint32_t x : {40u, 43u, 46u, 50u})
    EXPECT_EQ(io::OccupancyGrid::kUnknown, grid.at(x, 20)) << x;
}

TEST(NavigationMap, AFloorWithAPitIsTheGround) {
  std::vector<Cuboid> cuboids = {
      box({0.0, 0.0, -0.1}, {6.0, 2.0, 0.0}), box({0.0, 3.0, -0.1}, {6.0, 4.0, 0.0}),
      box({2.0, 2.0, -1.7}, {3.0, 3.0, -1.6}), box({1.9, 2.0, -1.6}, {2.0, 3.0, -0.1}),
      box({3.0, 2.0, -1.6}, {3.1, 3.0, -0.1})};
  for (std::size_t i = 0; i < 3; ++i) cuboids[i].plane_id = static_cast<std::int32_t>(i);
  const std::vector<Vector3> path = {{1.0, 1.0, 0.8}, {3.0, 1.0, 0.8}, {2.5, 2.5, 0.8}};
  EXPECT_NEAR(io::groundHeight(cuboids, Vector3::UnitZ(), path), 0.0, 1e-9);
}

}  // namespace
}  // namespace planar_mapping
