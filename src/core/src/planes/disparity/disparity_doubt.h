// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planes/disparity/disparity_fit.h"

namespace planar_mapping::detail {

/// Whether noise alone explains what lies off a plane that is thick for its width, as a trunk, a
/// shrub or a cushion is not explained: the residual is no larger than the noise of the frame and
/// much smaller in means of tiles, no quadratic surface fits better, its points lie together, and
/// hardly a point lies just in front of the plane or behind it.
/// \param parts   of all planes
/// \param list    those of this plane
/// \param labels  plane per pixel in tile order, -1 = none
bool isNoiseOfPlane(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                    const PartList& list, const TiledCloud& cloud,
                    const std::vector<std::int16_t>& labels, const DisparityParams& params);

}  // namespace planar_mapping::detail
