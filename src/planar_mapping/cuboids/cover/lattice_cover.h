// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/cuboids/cover/bit_grid.h"
#include "planar_mapping/cuboids/cover/cover_effort.h"
#include "planar_mapping/cuboids/cover/lattice_boxes.h"
#include "planar_mapping/cuboids/cover/set_cover.h"

namespace planar_mapping::detail {

/// A box and its fraction of the cells: each cell belongs to one of the boxes that stand for it.
struct CoverBox {
  LatticeBox box;
  std::vector<LatticeCell> members;
};

struct LatticeCoverage {
  std::vector<CoverBox> boxes;
  std::vector<std::size_t> sets;  ///< the sets that take part, ascending
};

/// [ours] Few boxes and sets that stand for all cells of \p required; boxes hold cells of
/// \p allowed only.
///
/// Greedy by newly covered cells over the sets and the largest boxes that fit; then boxes and sets
/// are dissolved into their neighbours, of which boxes grow for it, and each box is drawn back to
/// the cells it holds. Never more than without the sets. At full effort fewerSets() of boxes are
/// looked for then, beside the sets.
/// Cells of the lattice are halves of the user's: a pair that starts at an even number is
/// preferred. Deterministic. Every required cell must lie in a set or in a box of the smallest size
/// of allowed cells.
/// \param sets  cells that something other than a box may stand for: their CellNumbers among the
///              required ones
LatticeCoverage coverWithin(const BitGrid& required, const BitGrid& allowed,
                            const CoverRules& rules, const std::vector<CellSet>& sets = {},
                            CoverEffort effort = CoverEffort::Quick);

/// [ours] So many boxes are searched for; clutter that needs more gets them without a search, whose
/// time grows with their square. The recorded scenes of docs/dev/tried.md need 2,560 at most.
constexpr std::size_t kMaxBoxesSearched = 3072;

/// Boxes for the required cells one after the other, by z, y, x: each reaches as far ahead as it
/// may from the first cell that is left. In time proportional to the cells.
/// \return nothing if that takes at most \p few boxes: then coverWithin() can be afforded
std::vector<CoverBox> sweptOver(const BitGrid& required, const BitGrid& allowed,
                                const CoverRules& rules, std::size_t few = kMaxBoxesSearched);

}  // namespace planar_mapping::detail
