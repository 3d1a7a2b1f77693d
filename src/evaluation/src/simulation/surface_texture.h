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

/// Places on a surface, and what it looks like there.
struct TextureSamples {
  static constexpr int kCapacity = 256;
  int count = 0;
  float u[kCapacity];           ///< metres
  float v[kCapacity];           ///< metres
  float footprint[kCapacity];   ///< side of the square to average over, metres, > 0
  float contrast[kCapacity];    ///< of the texture there, in [0, 1], see textureAt()
  float brightness[kCapacity];  ///< result: factor around 1
};

/// Brightness of a surface, averaged over about the footprint of each sample, so that details too
/// small for a pixel fade instead of flickering.
/// \param flat  posters hang on flat faces only
void computeBrightness(const Material& material, bool flat, std::uint32_t seed,
                       TextureSamples& samples);

}  // namespace evaluation
}  // namespace planar_mapping
