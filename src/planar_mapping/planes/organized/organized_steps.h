// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/planes/organized/organized_assignment.h"

// Steps that the searches in metres and in disparity space share.
namespace planar_mapping::detail {

/// Fraction of min_inliers that the cells of a plane must hold before pixels are assigned.
constexpr double kMinSeedFraction = 0.4;

/// Grows planes over the cells of \p grid (tiles or quarters of them) and merges them.
/// \return plane per cell, -1 = none
std::vector<std::int16_t> growPlanes(CellGrower& grower, const CellGrid& grid, const PlaneFit& fit,
                                     int min_inliers, std::vector<PlaneCandidate>& planes,
                                     PixelLabels& pixels, PlaneSearchDiagnostics& diagnostics);

/// Sums and planes from the parts they hold.
void refit(std::vector<PlaneCandidate>& planes, const std::vector<TilePart>& parts,
           const PlaneFit& fit);

/// Refits planes to their pixels and frees those of planes that are too small or, if that is to be
/// tested, not coherent.
void reject(std::vector<PlaneCandidate>& planes, PixelLabels& pixels, double min_points,
            const TiledCloud& cloud, const PlaneFit& fit, bool test_coherence,
            PlaneSearchDiagnostics& diagnostics);

/// Frees the pixels of planes that are not valid.
void freeInvalid(const std::vector<PlaneCandidate>& planes, PixelLabels& pixels);

/// Sums planes over their pixels and makes a segment of each valid one, largest first, with its
/// inliers and patches. Patches are connected over neighbouring tiles, or over \p patch_gap metres
/// if that is positive.
/// \return the segment of each plane, null for one that is not valid
std::vector<PlaneSegment*> makeSegments(const PointsView& points, const TiledCloud& cloud,
                                        PixelLabels& pixels, double patch_gap,
                                        std::vector<PlaneCandidate>& planes, PlaneSet& set);

}  // namespace planar_mapping::detail
