// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/geometry/int3.h"

namespace planar_mapping::evaluation {

/// Cell of the standard lattice: it spans [x s, (x + 1) s) and so on in the world frame.
using GridCell = planar_mapping::detail::Int3;

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
