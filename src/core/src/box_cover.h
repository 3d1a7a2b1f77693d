// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cell_index.h"

namespace planar_mapping::detail {

/// Cells [low, low + size) of a grid.
struct CellBox {
  CellKey low{};
  CellKey size{};
};

/// Connected components of the cells (across faces, edges and corners).
/// \param cells distinct
/// \return component per cell, numbered by first cell
std::vector<std::int32_t> connectedComponents(const std::vector<CellKey>& cells,
                                              const CellIndex& index);

/// Covers the cells exactly with disjoint axis-aligned boxes, few of them: each component takes
/// the cheapest of the greedy covers that grow along the axes in a different order. Deterministic.
/// \param cells distinct, in any order
/// \param box_of_cell filled with the box of each cell if not null
std::vector<CellBox> coverWithBoxes(const std::vector<CellKey>& cells,
                                    std::vector<std::int32_t>* box_of_cell = nullptr);

}  // namespace planar_mapping::detail
