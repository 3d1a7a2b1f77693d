// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "planar_mapping/core/base/types.h"

namespace planar_mapping {
namespace evaluation {

/// Calls visit(x, y, z) for the cells of side \p s that the straight way from \p origin to \p end
/// crosses, in their order, without the one it ends in (Amanatides and Woo). Both points must be on
/// the lattice.
template <typename Visit>
void forEachCellOnRay(const Vector3& origin, const Vector3& end, double s, const Visit& visit) {
  std::int64_t cell[3];
  std::int64_t steps[3];  // left to do
  int direction[3];
  double next[3];  // share of the way at which the next border is crossed
  double per_cell[3];
  for (int k = 0; k < 3; ++k) {
    cell[k] = static_cast<std::int64_t>(std::floor(origin[k] / s));
    const std::int64_t last = static_cast<std::int64_t>(std::floor(end[k] / s));
    direction[k] = last > cell[k] ? 1 : -1;
    steps[k] = (last - cell[k]) * direction[k];
    const double way = std::abs(end[k] - origin[k]);
    const double border = static_cast<double>(cell[k] + (direction[k] > 0 ? 1 : 0)) * s;
    next[k] =
        steps[k] > 0 ? std::abs(border - origin[k]) / way : std::numeric_limits<double>::infinity();
    per_cell[k] = s / way;
  }
  while (steps[0] + steps[1] + steps[2] > 0) {
    visit(cell[0], cell[1], cell[2]);
    int axis = 0;
    for (const int k : {1, 2})
      if (next[k] < next[axis]) axis = k;
    cell[axis] += direction[axis];
    // Counted, so that rounding cannot lead past the end.
    next[axis] =
        --steps[axis] > 0 ? next[axis] + per_cell[axis] : std::numeric_limits<double>::infinity();
  }
}

}  // namespace evaluation
}  // namespace planar_mapping
