// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "planar_mapping/cuboids/compact_cover.h"
#include "planar_mapping/map/store/map_data.h"

namespace planar_mapping::detail {

/// What a plane's cuboids span along its normal: [-back, front], metres.
struct SurfaceBand {
  static constexpr double kSteps = 16.0;  ///< in a cell

  double front = 0.0;
  double back = 0.0;
};

/// What surfaceSpread() says: steps of the band up to kLinear of them, then kMax - kLinear wider
/// classes, a cell each, from kWide cells on.
struct SurfaceSpread {
  static constexpr std::uint8_t kLinear = 12;
  static constexpr std::uint8_t kMax = 15;
  static constexpr double kWide = 3.0;  ///< cells
};

/// How far from a plane its points are: surface_factor root mean square distances. In steps, or
/// every frame would move every cuboid a little.
inline std::uint8_t surfaceSpread(const MapData& map, const PlaneMoments& moments) {
  using Spread = SurfaceSpread;
  if (!map.isCompact() || !(map.params.surface_factor > 0.0)) return 0;
  const double cells = map.params.surface_factor * moments.fit().rms / map.resolution();
  constexpr double kWidest = Spread::kWide + (Spread::kMax - Spread::kLinear - 1);
  if (!(cells < kWidest)) return Spread::kMax;  // also if it is no number
  if (cells >= Spread::kWide) {
    return static_cast<std::uint8_t>(Spread::kLinear + 1 + std::floor(cells - Spread::kWide));
  }
  return static_cast<std::uint8_t>(
      std::min(std::round(cells * SurfaceBand::kSteps), double{Spread::kLinear}));
}

/// A noisy surface is where its points are: the cuboids reach as far as \p spread says before and
/// behind the plane, but not beyond kBack cells behind it, lest they leave the cells the surface is
/// in, and are at least as thick as was asked for. Before it they reach kFront cells, up to kBack
/// only where the points are spread over so many cells that the plane itself is off by a part of
/// one: what is correlated of their noise does not average out.
inline SurfaceBand surfaceBand(const MapData& map, std::uint8_t spread) {
  constexpr double kFront = 0.45;
  constexpr double kBack = 0.75;
  const double thickness = map.thickness();
  if (!map.isCompact() || !(map.params.surface_factor > 0.0)) return {0.0, thickness};
  const double s = map.resolution();
  const double reach = s / SurfaceBand::kSteps * std::min(spread, SurfaceSpread::kLinear);
  const int wide = std::max(spread - SurfaceSpread::kLinear, 0);
  const double most = wide > 0 ? 0.375 + 0.125 * wide : kFront;
  const double front = std::min({reach, most * s, std::max(most, 0.5) * thickness});
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
