// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "planar_mapping/core/export.h"

namespace planar_mapping {

using LatticeCell = std::array<std::int32_t, 3>;  ///< x, y, z of a cell

/// Cells [low, low + size) of a lattice.
struct LatticeBox {
  LatticeCell low{};
  LatticeCell size{};
};

/// Few axis-aligned boxes that cover exactly the cells and may overlap (greedy: what is left over
/// by earlier boxes gets the best box that grows from it, then superfluous boxes are taken away).
/// Deterministic, independent of the order of the cells but for ties.
/// \param cells  repeated ones count once
PLANAR_MAPPING_EXPORT std::vector<LatticeBox> coverCells(const std::vector<LatticeCell>& cells);

}  // namespace planar_mapping
