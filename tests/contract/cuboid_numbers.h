// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/core/geometry/cuboid.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::test {

/// Every number of the cuboids, to compare them bit by bit.
inline void append(const std::vector<Cuboid>& cuboids, std::vector<double>& numbers) {
  for (const Cuboid& c : cuboids) {
    numbers.insert(numbers.end(), c.center.data(), c.center.data() + 3);
    numbers.insert(numbers.end(), c.size.data(), c.size.data() + 3);
    numbers.insert(numbers.end(), c.orientation.coeffs().data(), c.orientation.coeffs().data() + 4);
    numbers.push_back(c.plane_id);
    numbers.push_back(c.probability);
  }
}

/// However few points they hold: the only points dropped are those that are not finite.
inline PlanarMapParams paramsWithAllCells() {
  PlanarMapParams params;
  params.min_cell_fraction = 0.0;
  return params;
}

}  // namespace planar_mapping::test
