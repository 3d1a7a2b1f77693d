// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "evaluation/baselines/grid_cell.h"
#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/cuboid.h"

namespace planar_mapping::evaluation {

/// Fusion as in RMAP (Khan, Wollherr, Buss: Adaptive rectangular cuboids for 3D mapping, 2015), a
/// **reconstruction**: neither its code nor its pseudocode was at hand. Two boxes that share one
/// complete face become one, until no pair is left that does. Runs are fused axis after axis; of
/// the six orders of the axes the one with the fewest boxes counts, for each part of the cells that
/// hangs together across faces.
/// \param cells  any order, repeated ones count once
/// \return boxes that cover exactly the cells, without overlap; the same for any order of the cells
PLANAR_MAPPING_EXPORT std::vector<GridBox> fuseCells(const std::vector<GridCell>& cells);

/// Axis-aligned boxes of occupied cells that may overlap and cover exactly the cells: what fusion
/// could reach at best if it knew all cells beforehand, up to the greed of the search. The bound
/// against which nobody can say that the baseline was weak. Each cell that is left gets the box
/// with most new cells of the six that grow from it along the axes in different order; cells with
/// few neighbours come first, and redundant boxes are removed.
/// \param cells  any order, repeated ones count once
/// \throws InputError for a cell 2^20 or more cells from the origin
PLANAR_MAPPING_EXPORT std::vector<GridBox> greedyCover(const std::vector<GridCell>& cells);

/// RMAP's second mode, a **reconstruction**: a box about occupied cells is kept if at least the
/// share \p density of its cells is occupied; else it is halved across its longest side, and each
/// half shrinks to its cells. Tolerant: boxes hold empty cells.
/// \param cells    any order, repeated ones count once
/// \param density  in (0, 1]; 1 covers exactly the cells
/// \return boxes without overlap; the same for any order of the cells
/// \throws ParameterError
PLANAR_MAPPING_EXPORT std::vector<GridBox> boxesByDensity(const std::vector<GridCell>& cells,
                                                          double density);

/// RA, the baseline of axis-aligned rectangular cuboids (RMAP), a **reconstruction**: the better of
/// fuseCells() and greedyCover() over the cells of a standard grid of the same points. RMAP has no
/// explicit free space; everything that is not occupied is free.
class PLANAR_MAPPING_EXPORT RectangularApproximation {
 public:
  /// O(cells log cells) for the fusion; the cover takes longest.
  /// \param s      side of a cell, metres, > 0
  /// \param cells  in any order
  /// \throws ParameterError; InputError as greedyCover()
  RectangularApproximation(double s, const std::vector<GridCell>& cells);

  /// N_f of RA: the smaller of both counts.
  std::size_t size() const { return boxes_.size(); }
  const std::vector<GridBox>& boxes() const { return boxes_; }
  std::vector<Cuboid> cuboids() const;

  /// Bytes of the live boxes in a flat array, 20 each (three corners of 4 bytes, three lengths of
  /// 2, belief 2): generous, since the R-tree that finds them is left out.
  std::size_t memoryBytes() const;
  /// Bytes of a file: a header of 42 bytes and each box's corner and lengths in as few bits as the
  /// bounding box and the longest lengths take.
  std::size_t fileBytes() const;

 private:
  double side_;
  std::vector<GridBox> boxes_;
};

}  // namespace planar_mapping::evaluation
