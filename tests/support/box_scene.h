// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::test {

enum class BoxKind : std::uint8_t {
  Shells,      ///< surfaces anywhere on the grid
  CellShells,  ///< surfaces of boxes of whole cells
  CellBlocks,  ///< boxes of whole cells with points all through
};

/// Points of random axis-aligned boxes around the origin, some in each eighth of a cell that a box
/// reaches.
/// \param width of the scene along x and y, cells; it is three tenths as high
inline std::vector<float> boxScene(Random& random, BoxKind kind, int boxes, double cell,
                                   double width) {
  const double per_cell = kind == BoxKind::CellBlocks ? 2.0 : 4.0;  // along each axis
  std::vector<float> xyz;
  for (int i = 0; i < boxes; ++i) {
    Vector3 low, high;
    int count[3];
    for (int k = 0; k < 3; ++k) {
      low[k] = random.uniform(-0.5, 0.5) * (k == 2 ? 0.3 : 1.0) * width;
      high[k] = low[k] + random.uniform(1.0, 16.0) * (random.below(4) == 0 ? 4.0 : 1.0);
      if (kind != BoxKind::Shells) {
        low[k] = std::floor(low[k]);
        high[k] = std::ceil(high[k]);
      }
      count[k] = std::max(1, static_cast<int>(std::lround(per_cell * (high[k] - low[k]))));
    }
    const auto isRim = [&](int k, int at) { return at == 0 || at == count[k] - 1; };
    for (int z = 0; z < count[2]; ++z) {
      for (int y = 0; y < count[1]; ++y) {
        for (int x = 0; x < count[0]; ++x) {
          const int at[3] = {x, y, z};
          if (kind != BoxKind::CellBlocks && !isRim(0, x) && !isRim(1, y) && !isRim(2, z)) continue;
          for (int k = 0; k < 3; ++k) {
            const double place = low[k] + (at[k] + 0.5) * (high[k] - low[k]) / count[k];
            xyz.push_back(static_cast<float>(cell * place));
          }
        }
      }
    }
  }
  return xyz;
}

/// Adds points without planes to a map, as one frame.
inline void insertPoints(PlanarMap& map, const std::vector<float>& xyz) {
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), static_cast<std::uint32_t>(xyz.size() / 3));
  map.insert(frame);
}

/// Of a map that keeps all points it is given and knows nothing of space.
inline PlanarMapParams keepAll(double cell) {
  PlanarMapParams params;
  params.approximation.resolution = cell;
  params.unknown_space = false;
  params.miss_factor = 1.0;
  return params;
}

}  // namespace planar_mapping::test
