// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planes/tiles/plane_fit.h"

namespace planar_mapping::detail {

/// Writes inliers and patches of \p segments, one per label, null for a label without pixels.
/// \param parts     what of each tile has which label, ascending by tile
/// \param patch_gap metres that separate patches; 0 = patches are connected over adjacent tiles
void listSegments(const PointsView& points, const TiledCloud& cloud,
                  const std::vector<std::int16_t>& labels, const std::vector<TilePart>& parts,
                  double patch_gap, const std::vector<PlaneSegment*>& segments);

}  // namespace planar_mapping::detail
