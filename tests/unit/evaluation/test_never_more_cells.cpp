// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Never more cuboids than RA's better variant has boxes, also where there is no plane to win by.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "box_scene.h"
#include "planar_mapping/evaluation/rectangular_approximation.h"
#include "planar_mapping/evaluation/standard_grid.h"

namespace planar_mapping::evaluation {
namespace {

std::size_t boxesOfRA(const std::vector<float>& xyz, double cell) {
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    points.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
  StandardGrid grid(cell);
  grid.insert(points);
  return RectangularApproximation(cell, grid.cells()).size();
}

struct SceneSize {
  int boxes;
  double width;  ///< cells; a region of the map has 64
};

TEST(NeverMoreCells, ThanRAInScenesOfBoxesWithoutPlanes) {
  std::size_t ours = 0, theirs = 0;
  std::uint64_t seed = 0;
  for (const test::BoxKind kind :
       {test::BoxKind::Shells, test::BoxKind::CellShells, test::BoxKind::CellBlocks}) {
    for (const double cell : {0.05, 0.1, 0.3}) {
      for (const SceneSize size : {SceneSize{12, 120.0}, {24, 60.0}, {30, 200.0}}) {
        Random random(++seed);
        const std::vector<float> xyz = test::boxScene(random, kind, size.boxes, cell, size.width);
        PlanarMap map(test::keepAll(cell));
        test::insertPoints(map, xyz);
        const std::size_t cuboids = map.cuboids().size();
        const std::size_t boxes = boxesOfRA(xyz, cell);
        EXPECT_LE(cuboids, boxes) << "seed " << seed;
        EXPECT_EQ(cuboids, map.cuboidCount());
        ours += cuboids;
        theirs += boxes;
      }
    }
  }
  RecordProperty("ours", std::to_string(ours));
  RecordProperty("RA", std::to_string(theirs));
  EXPECT_GE(seed, 20u);
  EXPECT_LT(10 * ours, 9 * theirs);
}

}  // namespace
}  // namespace planar_mapping::evaluation
