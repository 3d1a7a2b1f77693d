// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "planar_mapping/evaluation/scene.h"

namespace planar_mapping {
namespace evaluation {

/// Smooth noise in [0, 1] over the plane: bilinear between random values at whole numbers. The
/// same everywhere and always, so that a surface looks the same from every pose.
double valueNoise(double u, double v, std::uint32_t seed);

/// How much there is to match at surface coordinates u, v (metres), in [0, 1]: surfaces with little
/// texture have stretches with more and with less; \p plain_share of all surface has none.
double textureAt(const Material& material, double u, double v, double plain_share,
                 std::uint32_t seed);

/// Brightness factor around 1 of a surface at u, v (metres), averaged over about a square of
/// \p footprint metres, so that details too small for a pixel fade instead of flickering.
/// \param contrast  of the texture there, in [0, 1], see textureAt()
double brightnessAt(const Material& material, double u, double v, double footprint, double contrast,
                    bool flat, std::uint32_t seed);

}  // namespace evaluation
}  // namespace planar_mapping
