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

/// Brightness factor around 1 of a pattern at surface coordinates u, v (metres).
double patternBrightness(Pattern pattern, double u, double v, std::uint32_t seed);

}  // namespace evaluation
}  // namespace planar_mapping
