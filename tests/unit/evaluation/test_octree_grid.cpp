// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/baselines/octree_grid.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <memory>
#include <sstream>
#ifdef PLANAR_MAPPING_HAS_OCTOMAP
#include <octomap/OcTree.h>
#endif

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::evaluation {
namespace {

class OctreeGridTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!makeOctreeGrid(1.0)) GTEST_SKIP() << "built without OctoMap";
  }
  OctreeGrid& grid(double s, int min_points = 1) {
    return *grids_.emplace_back(makeOctreeGrid(s, min_points));
  }

 private:
  std::vector<std::unique_ptr<OctreeGrid>> grids_;
};

/// A wall at x = 4 m that fills the layer of cells behind it, seen from the origin.
std::vector<Vector3> wall(double s) {
  std::vector<Vector3> points;
  for (double y = -2.0; y < 2.0; y += s / 3.0)
    for (double z = 0.0; z < 2.0; z += s / 3.0) points.emplace_back(4.0 + s / 2.0, y, z);
  return points;
}

TEST_F(OctreeGridTest, OneRayHitsItsEndAndClearsTheCellsBefore) {
  OctreeGrid& octree = grid(1.0);
  octree.insert({{4.5, 0.5, 0.5}}, {}, {0.5, 0.5, 0.5});
  EXPECT_EQ(octree.counts().occupied_cells, 1u);
  EXPECT_EQ(octree.counts().free_cells, 4u);  // cells 0 to 3 along x
  const std::vector<Cuboid> cuboids = octree.cuboids();
  ASSERT_EQ(cuboids.size(), 1u);
  EXPECT_TRUE(cuboids[0].center.isApprox(Vector3(4.5, 0.5, 0.5)));
  EXPECT_TRUE(cuboids[0].size.isApprox(Vector3::Ones()));
  EXPECT_NEAR(cuboids[0].probability, 0.7, 1e-6);
  EXPECT_TRUE(octree.isFree({2.2, 0.9, 0.1}));
  EXPECT_FALSE(octree.isFree({4.5, 0.5, 0.5}));
  EXPECT_FALSE(octree.isFree({2.2, 1.1, 0.1}));
  EXPECT_FALSE(octree.isFree({test::kNan, 0.0, 0.0}));
  // Ground clears and is never occupied.
  OctreeGrid& of_ground = grid(1.0);
  of_ground.insert({}, {{4.5, 0.5, 0.5}}, {0.5, 0.5, 0.5});
  EXPECT_EQ(of_ground.counts().occupied_cells, 0u);
  EXPECT_EQ(of_ground.counts().free_cells, 4u);
  // A hit goes before a miss: the ray to the far point crosses the cell of the near one.
  OctreeGrid& of_two = grid(1.0);
  of_two.insert({{2.5, 0.5, 0.5}, {4.5, 0.5, 0.5}}, {}, {0.5, 0.5, 0.5});
  EXPECT_EQ(of_two.counts().occupied_cells, 2u);
  EXPECT_EQ(of_two.counts().free_cells, 3u);
}

TEST_F(OctreeGridTest, FewPointsOfOneFrameOnlyClear) {
  OctreeGrid& octree = grid(1.0, 2);
  octree.insert({{4.5, 0.5, 0.5}, {0.5, 3.4, 0.5}, {0.5, 3.6, 0.5}}, {}, {0.5, 0.5, 0.5});
  const std::vector<Cuboid> cuboids = octree.cuboids();
  ASSERT_EQ(cuboids.size(), 1u);
  EXPECT_TRUE(cuboids[0].center.isApprox(Vector3(0.5, 3.5, 0.5)));
  EXPECT_EQ(octree.counts().free_cells, 3u + 3u);  // the sensor's cell is shared
}

TEST_F(OctreeGridTest, CuboidsOfNegativeBlocksLieWhereTheirCellsAre) {
  OctreeGrid& octree = grid(0.1);
  std::vector<Vector3> block;
  for (int i = 0; i < 8; ++i)
    block.emplace_back(-1.55 + 0.1 * (i & 1), -1.55 + 0.1 * (i >> 1 & 1),
                       -1.55 + 0.1 * (i >> 2 & 1));
  for (int i = 0; i < 10; ++i) octree.insert(block, {}, {0.05, 0.05, 0.05});
  octree.finish();
  const std::vector<Cuboid> cuboids = octree.cuboids();
  ASSERT_EQ(cuboids.size(), 1u);
  EXPECT_TRUE(cuboids[0].center.isApprox(Vector3::Constant(-1.5), 1e-9));
}

TEST_F(OctreeGridTest, EndsWithFewerLeavesAndTheSameSpace) {
  OctreeGrid& octree = grid(0.1);
  // Every look sees less of it, so that neighbours are believed in differently.
  std::vector<Vector3> points = wall(0.1);
  for (int i = 0; i < 3; ++i) {
    octree.insert(points, {}, {0.05, 0.05, 0.55});
    points.resize(points.size() * 2 / 3);
  }
  const std::size_t cells = octree.counts().occupied_cells;
  const std::size_t free_cells = octree.counts().free_cells;
  const std::size_t leaves = octree.counts().occupied_leaves;
  const std::size_t nodes = octree.counts().nodes;
  const std::size_t file = octree.fileBytes();
  octree.finish();
  EXPECT_EQ(octree.counts().occupied_cells, cells);
  EXPECT_EQ(octree.counts().free_cells, free_cells);
  EXPECT_LE(octree.counts().occupied_leaves, leaves);
  EXPECT_LT(octree.counts().nodes, nodes);
  EXPECT_EQ(octree.fileBytes(), file);
  EXPECT_EQ(octree.cuboids().size(), octree.counts().occupied_leaves);
  double volume = 0.0;
  for (const Cuboid& cuboid : octree.cuboids()) volume += cuboid.volume();
  EXPECT_NEAR(volume, 1e-3 * static_cast<double>(cells), 1e-9);
}

#ifdef PLANAR_MAPPING_HAS_OCTOMAP
TEST_F(OctreeGridTest, InsertsAndWritesAsOctoMapDoes) {
  Random random(31);
  OctreeGrid& octree = grid(0.1);
  octomap::OcTree expected(0.1);
  for (int frame = 0; frame < 4; ++frame) {
    const Vector3 origin(0.05 + 0.3 * frame, 0.05, 0.55);
    std::vector<Vector3> points;
    octomap::Pointcloud cloud;
    for (int i = 0; i < 4000; ++i) {
      points.emplace_back(3.0 + 0.1 * random.normal(), random.uniform(-2, 2), random.uniform(0, 2));
      cloud.push_back(static_cast<float>(points.back().x()), static_cast<float>(points.back().y()),
                      static_cast<float>(points.back().z()));
    }
    octree.insert(points, {}, origin);
    expected.insertPointCloud(
        cloud,
        octomap::point3d(static_cast<float>(origin.x()), static_cast<float>(origin.y()),
                         static_cast<float>(origin.z())),
        -1.0, false, true);
  }
  EXPECT_EQ(octree.counts().nodes, expected.size());
  for (const Cuboid& cuboid : octree.cuboids()) {
    const octomap::OcTreeNode* node =
        expected.search(cuboid.center.x(), cuboid.center.y(), cuboid.center.z());
    ASSERT_NE(node, nullptr);
    EXPECT_EQ(static_cast<float>(node->getOccupancy()), cuboid.probability);
  }
  std::ostringstream with_beliefs;
  expected.write(with_beliefs);
  EXPECT_EQ(octree.otBytes(), with_beliefs.str().size());
  octree.finish();
  std::ostringstream file;
  expected.writeBinary(file);
  EXPECT_EQ(octree.fileBytes(), file.str().size());
  EXPECT_EQ(octree.counts().nodes, expected.size());
}
#endif

#ifndef PLANAR_MAPPING_SANITIZED
std::size_t heapInUse() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}
#endif

TEST_F(OctreeGridTest, HeapIsWhatMallocSaysOfTheTree) {
#ifdef PLANAR_MAPPING_SANITIZED
  GTEST_SKIP() << "malloc is the sanitizer's";
#else
  const std::vector<Vector3> points = wall(0.05);
  OctreeGrid& octree = grid(0.05);
  octree.insert({}, {}, {0.02, 0.02, 0.52});
  const std::size_t before = heapInUse();
  octree.insert(points, {}, {0.02, 0.02, 0.52});
  const auto measured = static_cast<double>(heapInUse() - before);
  ASSERT_GT(octree.counts().nodes, 10000u);
  EXPECT_NEAR(static_cast<double>(octree.heapBytes()) / measured, 1.0, 0.02);
#endif
}

TEST_F(OctreeGridTest, WorkSpaceForRaysIsNotCountedThoughATreeKeepsIt) {
#ifdef PLANAR_MAPPING_SANITIZED
  GTEST_SKIP() << "malloc is the sanitizer's";
#else
  const std::size_t before = heapInUse();
  const OctreeGrid& octree = grid(0.05);
  const auto measured = static_cast<double>(heapInUse() - before);
  EXPECT_NEAR(measured - static_cast<double>(octree.heapBytes()), 600e3, 5e3);
#endif
}

TEST_F(OctreeGridTest, PointsOutsideTheTreeAreDropped) {
  OctreeGrid& octree = grid(0.1);
  octree.insert({{test::kNan, 0, 0}, {1e9, 0, 0}}, {{0, test::kNan, 0}}, {0, 0, 0});
  EXPECT_EQ(octree.counts().dropped_points, 3u);
  EXPECT_EQ(octree.counts().nodes, 0u);
  octree.finish();
  EXPECT_EQ(octree.counts().occupied_leaves, 0u);
  EXPECT_TRUE(octree.cuboids().empty());
}

TEST_F(OctreeGridTest, RefusesBadInput) {
  OctreeGrid& octree = grid(0.1);
  EXPECT_THROW(octree.insert({}, {}, {test::kNan, 0, 0}), InputError);
  EXPECT_THROW(octree.insert({}, {}, {1e9, 0, 0}), InputError);
  EXPECT_THROW(makeOctreeGrid(0.0), ParameterError);
  EXPECT_THROW(makeOctreeGrid(1.0, 0), ParameterError);
}

}  // namespace
}  // namespace planar_mapping::evaluation
