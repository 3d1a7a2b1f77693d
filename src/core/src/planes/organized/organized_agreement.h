// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/organized/organized_assignment.h"

namespace planar_mapping::detail {

/// Frees the pixels whose surroundings do not lie as their plane does: what a plane cuts out of
/// objects it passes through, and what of a bent surface has turned away from it. Surroundings are
/// all measured points near a quarter of a tile, of the plane or not, so that a thin slice cannot
/// vouch for itself. They are wider where the noise is too large for a small window. A plane nearly
/// all of whose pixels agree keeps them all, one that few agree with loses them all.
void freeDisagreeing(const TiledCloud& cloud, const std::vector<PlaneCandidate>& planes,
                     const MetricFit& fit, int threads, PixelAssigner& pixels);

}  // namespace planar_mapping::detail
