// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "map_data.h"
#include "planar_mapping/core/compact_cover.h"

namespace planar_mapping::detail {

/// What a plane's cuboids span along its normal: [-back, front], metres.
struct SurfaceBand {
  double front = 0.0;
  double back = 0.0;
  bool operator==(const SurfaceBand& o) const { return front == o.front && back == o.back; }
};

/// A noisy surface is where its points are: the cuboids reach so many root mean square distances of
/// them before and behind the plane, but not beyond kFront and kBack cells, lest they leave the
/// cells the surface is in, and are at least as thick as was asked for. A function of what the file
/// keeps of the plane.
inline SurfaceBand surfaceBand(const MapData& map, const PlaneMoments& moments) {
  constexpr double kFront = 0.45;
  constexpr double kBack = 0.75;
  const double thickness = map.thickness();
  if (!map.isCompact() || !(map.params.surface_factor > 0.0)) return {0.0, thickness};
  const double s = map.resolution();
  // In steps, or every frame would move every cuboid a little.
  const double step = s / 16.0;
  const double spread = step * std::round(map.params.surface_factor * moments.fit().rms / step);
  const double front = std::min({spread, kFront * s, 0.5 * thickness});
  return {front, std::max(thickness - front, std::min(spread, kBack * s))};
}

/// The cuboid of a rectangle of the plane, which extends backwards from the band's front.
inline Cuboid cuboidOf(const HalfCellRectangle& rectangle, const PlaneFrame& plane,
                       const SurfaceBand& band, const CuboidApproximationParams& params) {
  PlaneFrame frame = plane;
  frame.origin += band.front * frame.n;
  CuboidApproximationParams with_band = params;
  with_band.thickness = band.front + band.back;
  return cuboidOf(rectangle, frame, with_band);
}

}  // namespace planar_mapping::detail
