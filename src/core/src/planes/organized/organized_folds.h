// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/organized/metric_fit.h"

namespace planar_mapping::detail {

/// Cuts planes that grew over folds. In noise as large as a cell, the normals of cells do not tell
/// the two sides of a blunt fold apart and both fit one plane about as well as their own, point by
/// point; all points together do not. A region is cut along the straight line in the image that
/// leaves least squares along the rays the least error, as long as that gains more than chance and
/// the sides are at an angle, and so are its parts. Only where the noise is white, because only
/// then is what chance gains known.
/// \param tile_labels plane of each tile, -1 = none; cut off parts get new planes, without sums
void cutFolds(const CellGrid& tiles, const MetricFit& fit, std::vector<PlaneCandidate>& planes,
              std::vector<std::int16_t>& tile_labels);

/// Whether two planes, which together are \p joined, are the sides of a fold.
bool isFold(const PlaneCandidate& one, const PlaneCandidate& other, const PlaneCandidate& joined,
            const MetricFit& fit);

}  // namespace planar_mapping::detail
