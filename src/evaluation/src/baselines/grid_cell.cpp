// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/grid_cell.h"

namespace planar_mapping {
namespace evaluation {

Cuboid cuboidOf(const GridBox& box, double s) {
  Cuboid cuboid;
  cuboid.size = s * Vector3(box.size.x, box.size.y, box.size.z);
  cuboid.center = s * Vector3(box.low.x, box.low.y, box.low.z) + 0.5 * cuboid.size;
  return cuboid;
}

std::vector<Cuboid> cuboidsOf(const std::vector<GridCell>& cells, double s) {
  std::vector<Cuboid> cuboids;
  cuboids.reserve(cells.size());
  for (const GridCell& cell : cells) cuboids.push_back(cuboidOf({cell, {1, 1, 1}}, s));
  return cuboids;
}

std::vector<Cuboid> cuboidsOf(const std::vector<GridBox>& boxes, double s) {
  std::vector<Cuboid> cuboids;
  cuboids.reserve(boxes.size());
  for (const GridBox& box : boxes) cuboids.push_back(cuboidOf(box, s));
  return cuboids;
}

}  // namespace evaluation
}  // namespace planar_mapping
