// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/cuboids/compact_cover.h"
#include "planar_mapping/geometry/cuboid.h"

namespace planar_mapping::test {

/// Euclidean distance from the point to the cuboid, 0 inside, metres.
inline double distanceTo(const Cuboid& cuboid, const Vector3& point) {
  const Vector3 local = cuboid.orientation.conjugate() * (point - cuboid.center);
  return (local.cwiseAbs() - 0.5 * cuboid.size).cwiseMax(0.0).norm();
}

/// An axis-aligned one.
inline Cuboid cuboidAt(const Vector3& center, const Vector3& size) {
  Cuboid cuboid;
  cuboid.center = center;
  cuboid.size = size;
  return cuboid;
}

inline NonPlanarCell cellAt(int x, int y, int z) {
  NonPlanarCell cell;
  cell.x = x;
  cell.y = y;
  cell.z = z;
  return cell;
}

/// Of a cover in cells of 0.1 m.
inline CuboidApproximationParams paramsWith(double absorption, double rectangle_cells = 0.0) {
  CuboidApproximationParams params;
  params.resolution = 0.1;
  params.absorption = absorption;
  params.rectangle_cells = rectangle_cells;
  return params;
}

/// The boxes, where no cuboid may be replaced.
inline std::vector<Cuboid> boxesFor(const std::vector<NonPlanarCell>& cells,
                                    const std::vector<SurfacePiece>& pieces,
                                    const std::vector<Cuboid>& present,
                                    const CuboidApproximationParams& params) {
  return coverWithBoxes(cells, pieces, present, {}, params).boxes;
}

/// The cuboid moved by T.
inline Cuboid transformed(const Cuboid& cuboid, const Pose& T) {
  Cuboid moved = cuboid;
  moved.center = T * cuboid.center;
  moved.orientation = (Quaternion(T.linear()) * cuboid.orientation).normalized();
  return moved;
}

/// All that cuboids say, one after the other, to be compared exactly.
inline std::vector<double> numbersOf(const std::vector<Cuboid>& cuboids,
                                     bool with_probability = true) {
  std::vector<double> numbers;
  for (const Cuboid& c : cuboids) {
    numbers.insert(numbers.end(), c.center.data(), c.center.data() + 3);
    numbers.insert(numbers.end(), c.size.data(), c.size.data() + 3);
    numbers.insert(numbers.end(), c.orientation.coeffs().data(), c.orientation.coeffs().data() + 4);
    numbers.push_back(c.plane_id);
    if (with_probability) numbers.push_back(c.probability);
  }
  return numbers;
}

}  // namespace planar_mapping::test
