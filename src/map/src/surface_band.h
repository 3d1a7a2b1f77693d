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
  static constexpr double kSteps = 16.0;  ///< in a cell

  double front = 0.0;
  double back = 0.0;
};

/// How far from a plane its points are, in steps of the band: surface_factor root mean square
/// distances. In steps, or every frame would move every cuboid a little. A function of what the
/// file keeps of the plane.
inline std::uint8_t surfaceSpread(const MapData& map, const PlaneMoments& moments) {
  if (!map.isCompact() || !(map.params.surface_factor > 0.0)) return 0;
  const double step = map.resolution() / SurfaceBand::kSteps;
  const double steps = std::round(map.params.surface_factor * moments.fit().rms / step);
  return static_cast<std::uint8_t>(steps < 255.0 ? steps : 255.0);  // far beyond any band
}

/// A noisy surface is where its points are: the cuboids reach as far as \p spread says before and
/// behind the plane, but not beyond kFront and kBack cells, lest they leave the cells the surface
/// is in, and are at least as thick as was asked for.
inline SurfaceBand surfaceBand(const MapData& map, std::uint8_t spread) {
  constexpr double kFront = 0.45;
  constexpr double kBack = 0.75;
  const double thickness = map.thickness();
  if (!map.isCompact() || !(map.params.surface_factor > 0.0)) return {0.0, thickness};
  const double s = map.resolution();
  const double reach = s / SurfaceBand::kSteps * spread;
  const double front = std::min({reach, kFront * s, 0.5 * thickness});
  return {front, std::max(thickness - front, std::min(reach, kBack * s))};
}
inline SurfaceBand surfaceBand(const MapData& map, const PlaneMoments& moments) {
  return surfaceBand(map, surfaceSpread(map, moments));
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
