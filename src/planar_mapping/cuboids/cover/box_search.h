// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "planar_mapping/cuboids/cover/bit_grid.h"
#include "planar_mapping/cuboids/cover/lattice_boxes.h"
#include "planar_mapping/cuboids/cover/set_cover.h"

namespace planar_mapping::detail {

/// What boxes are searched in.
struct BoxSpace {
  const BitGrid& allowed;  ///< cells that boxes may hold
  const CoverRules& rules;
  const CellNumbers& numbers;             ///< of the required cells
  const std::vector<LatticeCell>& cells;  ///< these, by their numbers
  const BoxList& largest;                 ///< boxes that cannot grow
};

/// [ours] Fewer boxes for some of the required cells than there are, by fewerSets() of the largest
/// ones.
/// \param covered  numbers of the cells, ascending
/// \param needs    hulls of what each box there is answers for, together all of \p covered
/// \return the numbers of the cells that each box answers for, ascending, each cell once; nothing
///         if no fewer are found, or if boxes and needs are too many to search
std::optional<std::vector<CellSet>> fewerBoxes(const BoxSpace& space, const CellSet& covered,
                                               const BoxList& needs);

}  // namespace planar_mapping::detail
