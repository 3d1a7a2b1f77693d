// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/baselines/standard_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::evaluation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(StandardGrid, CellsAreHalfOpenCubesOfTheLattice) {
  StandardGrid grid(0.5);
  grid.insert({{0.0, 0.0, 0.0}, {0.49, 0.2, 0.1}, {0.5, 0.0, 0.0}, {-0.01, 0.0, -0.5}});
  const std::vector<GridCell> expected = {{-1, 0, -1}, {0, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(grid.cells(), expected);
  EXPECT_EQ(grid.size(), 3u);
  const std::vector<Cuboid> cuboids = grid.cuboids();
  ASSERT_EQ(cuboids.size(), 3u);
  EXPECT_TRUE(cuboids[0].center.isApprox(Vector3(-0.25, 0.25, -0.25)));
  EXPECT_TRUE(cuboids[0].size.isApprox(Vector3::Constant(0.5)));
  EXPECT_EQ(cuboids[0].state, CellState::Occupied);
}

TEST(StandardGrid, AgreesWithASetOfCells) {
  Random random(3);
  StandardGrid grid(0.1);
  std::set<std::tuple<int, int, int>> expected;
  for (int frame = 0; frame < 4; ++frame) {
    std::vector<Vector3> points;
    for (int i = 0; i < 5000; ++i) {
      points.emplace_back(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-1, 1));
      expected.emplace(static_cast<int>(std::floor(points.back().z() / 0.1)),
                       static_cast<int>(std::floor(points.back().y() / 0.1)),
                       static_cast<int>(std::floor(points.back().x() / 0.1)));
    }
    grid.insert(points);
  }
  std::vector<GridCell> cells;
  for (const auto& [z, y, x] : expected) cells.push_back({x, y, z});
  EXPECT_EQ(grid.cells(), cells);
}

TEST(StandardGrid, FewPointsOfOneFrameMakeNoCell) {
  StandardGrid grid(1.0, 3);
  grid.insert({{0.1, 0.1, 0.1}, {0.2, 0.2, 0.2}, {5.1, 0.0, 0.0}, {5.2, 0.0, 0.0}, {5.3, 0, 0}});
  const std::vector<GridCell> one = {{5, 0, 0}};
  EXPECT_EQ(grid.cells(), one);
  grid.insert({{0.3, 0.3, 0.3}, {0.2, 0.2, 0.2}});  // four in two frames are not three in one
  EXPECT_EQ(grid.cells(), one);
  grid.insert({{0.3, 0.3, 0.3}, {0.2, 0.2, 0.2}, {0.9, 0.9, 0.9}});
  EXPECT_EQ(grid.size(), 2u);
}

TEST(StandardGrid, RaysCrossTheCellsTheySample) {
  // Cells all around; those that vanish after many looks are those that points of the ray are in.
  Random random(21);
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3 origin(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2));
    const GridCell last{static_cast<int>(random.below(6)) - 3,
                        static_cast<int>(random.below(6)) - 3,
                        static_cast<int>(random.below(6)) - 3};
    const Vector3 end(last.x + 0.5, last.y + 0.5, last.z + 0.5);
    std::vector<Vector3> block;
    for (int i = 0; i < 216; ++i) block.emplace_back(i % 6 - 2.5, i / 6 % 6 - 2.5, i / 36 - 2.5);
    StandardGrid grid(1.0);
    grid.insert(block);
    for (int i = 0; i < 3; ++i) grid.insert({}, {end}, origin);
    std::set<std::tuple<int, int, int>> crossed;
    for (int i = 0; i <= 4000; ++i) {
      const Vector3 p = origin + (end - origin) * (i / 4000.0);
      crossed.emplace(static_cast<int>(std::floor(p.z())), static_cast<int>(std::floor(p.y())),
                      static_cast<int>(std::floor(p.x())));
    }
    crossed.erase({last.z, last.y, last.x});
    const std::size_t left = 216 - crossed.size();
    for (const GridCell& cell : grid.cells())
      EXPECT_EQ(crossed.count({cell.z, cell.y, cell.x}), 0u);
    // A corner may be cut by less than the samples are apart.
    EXPECT_LE(grid.size(), left);
    EXPECT_GE(grid.size() + 1, left);
  }
}

TEST(StandardGrid, PointsBeyondTheLatticeAreDropped) {
  StandardGrid grid(0.1);
  grid.insert({{test::kNan, 0, 0}, {0, kInfinity, 0}, {0, 0, -1e300}, {1e6, 0, 0}, {1e5, 0, 0}});
  const std::vector<GridCell> expected = {{1000000, 0, 0}};
  EXPECT_EQ(grid.cells(), expected);
}

TEST(StandardGrid, MemoryIsTwelveBytesASlot) {
  StandardGrid grid(1.0);
  std::vector<Vector3> points;
  for (int i = 0; i < 1000; ++i) points.emplace_back(i + 0.5, 0.5, 0.5);
  grid.insert(points);
  // A power of two of slots, at most three quarters of them taken: 2048 for 1000 cells.
  EXPECT_EQ(grid.memoryBytes(), 2048u * 12u);
}

TEST(StandardGrid, FileTakesTheBitsOfTheBoundingBox) {
  StandardGrid grid(1.0);
  // 4 x 3 x 2 = 24 places, 5 bits each; three cells are 15 bits, two bytes.
  grid.insert({{10.5, 20.5, 30.5}, {13.5, 22.5, 31.5}, {11.5, 20.5, 30.5}});
  EXPECT_EQ(grid.fileBytes(), 36u + 2u);
  StandardGrid one(1.0);
  one.insert({{0.5, 0.5, 0.5}});
  EXPECT_EQ(one.fileBytes(), 36u);
}

TEST(StandardGrid, RefusesBadParameters) {
  EXPECT_THROW(StandardGrid(0.0), ParameterError);
  EXPECT_THROW(StandardGrid(-1.0), ParameterError);
  EXPECT_THROW(StandardGrid{test::kNan}, ParameterError);
  EXPECT_THROW(StandardGrid{kInfinity}, ParameterError);
  EXPECT_THROW(StandardGrid(0.1, 0), ParameterError);
}

}  // namespace
}  // namespace planar_mapping::evaluation
