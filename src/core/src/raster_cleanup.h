// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/plane_raster.h"

namespace planar_mapping::detail {

/// [ours] Takes away and fills single cells along the border where that makes the region simpler.
///
/// A cell may go if all its points are within half a cell of a neighbour that stays (\p quarters,
/// as in PlanePatch; null = no cell may go). An empty cell may be filled if \p fill is set and
/// cells are occupied on both sides of it, along u or along v. Either happens only if it lowers
/// 3 x concave + convex corners, which is four times the number of rectangles of a minimum
/// partition but for the chords: one of the region's corners gone counts, its area does not.
void simplifyBorder(CellMask& mask, const std::uint8_t* quarters, bool fill);

}  // namespace planar_mapping::detail
