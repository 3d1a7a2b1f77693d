// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/map/store/cell_layer.h"

namespace planar_mapping::detail {

/// Adds a place that holds points to non-planar cells; where they have one, the larger belief is
/// kept.
/// \param point  metres \param s  side of a cell, metres
void addPart(const Vector3& point, double s, std::uint8_t belief, bool is_compact,
             CellLayer& cells);

}  // namespace planar_mapping::detail
