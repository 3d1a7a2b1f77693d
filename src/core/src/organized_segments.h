// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "organized_refinement.h"

namespace planar_mapping::detail {

/// Writes the valid planes and the pixels they hold to \p set, largest first. Patches are connected
/// over neighbouring tiles, or over params.patch_gap if that is given.
void writeSegments(const PointsView& points, const TiledCloud& cloud,
                   const std::vector<PlaneCandidate>& planes, const PixelAssigner& pixels,
                   const std::vector<TilePart>& parts, const MultiPlaneParams& params,
                   const Vector3& sensor, PlaneSet& set);

}  // namespace planar_mapping::detail
