// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/core/planes/multi_plane.h"

namespace planar_mapping::detail {

/// Splits the inliers of a segment into connected patches on a bitmap in its plane and writes
/// segment.patches and segment.number_of_patches. Inliers within \p gap of each other are always
/// connected, inliers more than 2.2 gaps from all others of a patch never.
void findPatches(const PointsView& points, double gap, PlaneSegment& segment);

/// [ours] The gap when none is given: four thresholds, or four times the mean spacing of the
/// inliers where they are sparser than that.
double automaticPatchGap(const PlaneMoments::Fit& fit, double inliers, double distance_threshold);

}  // namespace planar_mapping::detail
