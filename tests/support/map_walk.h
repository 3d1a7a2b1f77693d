// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::test {

/// The defaults, with cells of that many metres.
inline PlanarMapParams paramsAt(double resolution) {
  PlanarMapParams params;
  params.approximation.resolution = resolution;
  return params;
}

/// A walk through the scene of map_scene.h, each frame \p step metres and 0.1 rad from the last.
inline std::vector<View> walk(int frames, double step = 0.15) {
  std::vector<View> views;
  for (int i = 0; i < frames; ++i)
    views.push_back(look(Scene(), lookFrom({-0.3 + step * i, -0.4, 1.1}, 0.1 * i - 0.1), i));
  return views;
}

/// Fraction of the points that lie in or within margin of an occupied cuboid.
inline double coverage(const PlanarMap& map, const View& view, double margin) {
  std::size_t points = 0, covered = 0;
  for (std::size_t i = 0; i < view.xyz.size() / 3; i += 37) {
    const Vector3 p(view.xyz[3 * i], view.xyz[3 * i + 1], view.xyz[3 * i + 2]);
    if (!p.allFinite()) continue;
    ++points;
    covered += map.cuboidsAt(view.pose * p, margin).empty() ? 0 : 1;
  }
  return static_cast<double>(covered) / static_cast<double>(points);
}

}  // namespace planar_mapping::test
