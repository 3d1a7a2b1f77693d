// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboids/cover/bit_grid.h"
#include "cuboids/cover/lattice_boxes.h"

namespace planar_mapping::detail {

/// [ours] Boxes that hold exactly the cells that are on, found as grids of boxes find them: by
/// fusing boxes that share a complete face, axis after axis in each of the six orders, or by a
/// greedy cover whose boxes may overlap. The fewest of these for each part of the cells that hangs
/// together across faces. Deterministic.
BoxList coverOfCells(const BitGrid& cells);

}  // namespace planar_mapping::detail
