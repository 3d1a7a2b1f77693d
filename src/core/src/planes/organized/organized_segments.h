// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planes/organized/organized_refinement.h"

namespace planar_mapping::detail {

/// Writes inliers and patches of \p segments, one per label, null for a label without pixels.
/// \param parts     what of each tile has which label, ascending by tile
/// \param patch_gap metres that separate patches; 0 = patches are connected over adjacent tiles
void listSegments(const PointsView& points, const TiledCloud& cloud,
                  const std::vector<std::int16_t>& labels, const std::vector<TilePart>& parts,
                  double patch_gap, const std::vector<PlaneSegment*>& segments);

/// Writes the valid planes and the pixels they hold to \p set, largest first. Patches are connected
/// over neighbouring tiles, or over params.patch_gap if that is given.
void writeSegments(const PointsView& points, const TiledCloud& cloud,
                   const std::vector<PlaneCandidate>& planes, const PixelAssigner& pixels,
                   const std::vector<TilePart>& parts, const MultiPlaneParams& params,
                   const Vector3& sensor, PlaneSet& set);

}  // namespace planar_mapping::detail
