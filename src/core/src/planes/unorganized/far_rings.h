// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/unorganized/cell_assignment.h"

namespace planar_mapping::detail {

/// Makes planes candidates of the cells beyond their leaves that hold a piece of a scanner's ring
/// on them: a line in the plane that the sensor sees next to what is on the plane already, with
/// nothing between, ring by ring. Where rings are far apart they make no leaves.
/// \param planes those with a zero normal take no cells
void addFarRings(const PointCells& grid, const std::vector<Plane>& planes, const DistanceBand& band,
                 const Vector3& sensor, CellCandidates& candidates);

}  // namespace planar_mapping::detail
