// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "planar_mapping/evaluation/scene.h"

namespace planar_mapping {
namespace evaluation {

/// How much there is to match at surface coordinates u, v (metres), in [0, 1]: surfaces with little
/// texture have stretches with more and with less; the fraction \p plain_share of all surface has
/// none.
double textureAt(const Material& material, double u, double v, double plain_share,
                 std::uint32_t seed);

/// Brightness of a surface, a factor around 1: an image of its pattern, tiled over the surface in
/// pieces that \p seed shuffles, averaged over a square of side \p footprint (metres, > 0).
/// \param contrast  of the pattern there, in [0, 1], see textureAt()
/// \param flat      posters hang on flat faces only
double brightnessAt(const Material& material, bool flat, std::uint32_t seed, double u, double v,
                    double footprint, double contrast);

}  // namespace evaluation
}  // namespace planar_mapping
