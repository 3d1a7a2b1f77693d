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

/// How far from a plane its points are: surface_factor root mean square distances, in steps of the
/// band up to kLinear of them; one, two or three more where that is at least 3, 4 or 5 cells. In
/// steps, or every frame would move every cuboid a little. A function of what the file keeps of the
/// plane.
struct SurfaceSpread {
  static constexpr std::uint8_t kLinear = 12;
  static constexpr std::uint8_t kMost = 15;
  static constexpr double kWide = 3.0;  ///< cells
};

inline std::uint8_t surfaceSpread(const MapData& map, const PlaneMoments& moments) {
  if (!map.isCompact() || !(map.params.surface_factor > 0.0)) return 0;
  const double cells = map.params.surface_factor * moments.fit().rms / map.resolution();
  constexpr double kSteps = SurfaceSpread::kMost - SurfaceSpread::kLinear;
  const double wide = std::clamp(std::floor(cells - SurfaceSpread::kWide + 1.0), 0.0, kSteps);
  const double linear =
      std::min(std::round(cells * SurfaceBand::kSteps), double{SurfaceSpread::kLinear});
  return static_cast<std::uint8_t>(linear + wide);
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
