// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What was covered in parts is covered anew as a whole.
#include <gtest/gtest.h>

#include <vector>

#include "planar_mapping/core/cuboids/detail/compact_cover.h"

namespace planar_mapping {
namespace {

/// The boxes, where no cuboid may be replaced.
std::vector<Cuboid> boxesFor(const std::vector<NonPlanarCell>& cells,
                             const std::vector<SurfacePiece>& pieces,
                             const std::vector<Cuboid>& present,
                             const CuboidApproximationParams& params) {
  return coverWithBoxes(cells, pieces, present, {}, params).boxes;
}

NonPlanarCell cellAt(std::int32_t x, std::int32_t y, std::int32_t z) {
  NonPlanarCell cell;
  cell.x = x;
  cell.y = y;
  cell.z = z;
  return cell;
}

TEST(CoverAgain, JoinsWhatWasCoveredInParts) {
  const CuboidApproximationParams params;
  std::vector<NonPlanarCell> left, right, all;
  for (int x = 0; x < 10; ++x) {
    for (int y = 0; y < 3; ++y) (x < 4 ? left : right).push_back(cellAt(x, y, 0));
  }
  std::vector<Cuboid> boxes = boxesFor(left, {}, {}, params);
  for (const Cuboid& box : boxesFor(right, {}, {}, params)) boxes.push_back(box);
  ASSERT_EQ(boxes.size(), 2u);
  all = left;
  all.insert(all.end(), right.begin(), right.end());
  all.push_back(cellAt(30, 1, 0));  // which none of the boxes stands for
  const std::vector<Cuboid> again = coverAgain(boxes, all, {}, {}, params);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_TRUE(again.front().center.isApprox(Vector3(0.5, 0.15, 0.05)));
  EXPECT_TRUE(again.front().size.isApprox(Vector3(1.0, 0.3, 0.1)));
}

TEST(CoverAgain, KeepsBoxesWhereItFindsNoFewer) {
  const CuboidApproximationParams params;
  const std::vector<NonPlanarCell> cells{cellAt(0, 0, 0), cellAt(9, 0, 0)};
  std::vector<Cuboid> boxes = boxesFor(cells, {}, {}, params);
  ASSERT_EQ(boxes.size(), 2u);
  boxes.front().probability = 0.25f;  // so that they can be told apart
  EXPECT_EQ(coverAgain(boxes, cells, {}, {}, params).front().probability, 0.25f);
  // And drops what a cuboid stands for.
  Cuboid wall;
  wall.center = {0.05, 0.05, 0.05};
  wall.size = {0.1, 0.1, 0.1};
  const std::vector<Cuboid> again = coverAgain(boxes, cells, {}, {wall}, params);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_NEAR(again.front().center.x(), 0.95, 1e-9);
}

}  // namespace
}  // namespace planar_mapping
