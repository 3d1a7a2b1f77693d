// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/geometry/cuboid.h"

namespace planar_mapping::evaluation {

/// Cell of the standard lattice: it spans [x s, (x + 1) s) and so on in the world frame.
struct GridCell {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t z = 0;

  /// x, y or z for axis 0, 1, 2.
  std::int32_t& operator[](std::size_t axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  std::int32_t operator[](std::size_t axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  bool operator==(const GridCell& other) const {
    return x == other.x && y == other.y && z == other.z;
  }
  bool operator!=(const GridCell& other) const { return !(*this == other); }
  /// By z, then y, then x.
  bool operator<(const GridCell& other) const {
    if (z != other.z) return z < other.z;
    if (y != other.y) return y < other.y;
    return x < other.x;
  }
};

/// Axis-aligned box of cells: low <= cell < low + size.
struct GridBox {
  GridCell low;
  GridCell size{1, 1, 1};  ///< cells along each axis, >= 1

  bool operator==(const GridBox& other) const { return low == other.low && size == other.size; }
  std::int64_t cells() const { return static_cast<std::int64_t>(size.x) * size.y * size.z; }
};

/// The box as a cuboid of the world frame; s is the side of a cell, metres.
PLANAR_MAPPING_EXPORT Cuboid cuboidOf(const GridBox& box, double s);
/// The cells as cubes, in their order.
PLANAR_MAPPING_EXPORT std::vector<Cuboid> cuboidsOf(const std::vector<GridCell>& cells, double s);
/// The boxes as cuboids, in their order.
PLANAR_MAPPING_EXPORT std::vector<Cuboid> cuboidsOf(const std::vector<GridBox>& boxes, double s);

}  // namespace planar_mapping::evaluation
