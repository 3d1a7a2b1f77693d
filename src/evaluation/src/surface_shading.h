// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "object_view.h"

namespace planar_mapping {
namespace evaluation {

constexpr std::uint32_t kSkyColor = 0xBFD2E6;

/// What there is to know about a point of a surface beside its place.
struct SurfacePoint {
  double incidence = 0.0;  ///< cosine between ray and normal, in [0, 1]
  double texture = 0.0;    ///< how much there is to match, in [0, 1]
  /// Factor of the material's colour: light times pattern, averaged over the pixel.
  double brightness = 0.0;
};

/// \param ray  through the pixel, camera frame, z = 1
/// \param pixel_x  size of a pixel on the plane z = 1; likewise \p pixel_y
/// \param colors  false: brightness is left at 0
SurfacePoint surfacePointAt(const ObjectView& view, int face, double depth, const Vector3& ray,
                            double pixel_x, double pixel_y, double plain_share, bool colors);

/// 0xRRGGBB; channels are clamped.
std::uint32_t shaded(std::uint32_t color, double brightness);

}  // namespace evaluation
}  // namespace planar_mapping
