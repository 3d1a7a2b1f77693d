// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What was covered in parts is covered anew as a whole.
#include <gtest/gtest.h>

#include <algorithm>
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

/// What is left of a plane at 45 degrees: boxes about it reach a half cell before and behind it,
/// not farther into what may be free.
TEST(BoxCover, AboutASlantedPlaneStaysNearIt) {
  const CuboidApproximationParams params;
  std::vector<SurfacePiece> pieces;
  for (int i = 0; i < 40; ++i) {
    for (int z = 0; z < 8; ++z) {
      const double along = 0.025 * i + 0.0125;
      pieces.push_back({Vector3(along, along, 0.025 * z + 0.0125), 1.0f});
    }
  }
  const std::vector<Cuboid> boxes = boxesFor({}, pieces, {}, params);
  ASSERT_FALSE(boxes.empty());
  for (const Cuboid& box : boxes) {
    // The corners farthest from the plane x = y, in half cells along x.
    const double low = box.center.x() + 0.5 * box.size.x() - (box.center.y() - 0.5 * box.size.y());
    const double high = box.center.y() + 0.5 * box.size.y() - (box.center.x() - 0.5 * box.size.x());
    EXPECT_LE(std::max(low, high) / (0.5 * params.resolution), 2.0 + 1e-9)
        << box.center.transpose();
  }
  for (const SurfacePiece& piece : pieces) {
    const bool is_covered = std::any_of(boxes.begin(), boxes.end(), [&](const Cuboid& box) {
      return ((piece.center - box.center).cwiseAbs() - 0.5 * box.size).maxCoeff() <=
             0.5 * params.resolution + 1e-9;
    });
    EXPECT_TRUE(is_covered) << piece.center.transpose();
  }
}

}  // namespace
}  // namespace planar_mapping
