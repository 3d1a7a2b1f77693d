// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cuboids/cuboid_reach.h"
#include "cuboids/cover/lattice_cover.h"
#include "cuboids/rest_elements.h"

namespace planar_mapping::detail {

/// Elements next to each other in memory.
struct ElementRange {
  const Element* first = nullptr;
  const Element* last = nullptr;

  const Element* begin() const { return first; }
  const Element* end() const { return last; }
};

/// A cuboid that boxes may take the place of, with the elements of its own surface.
struct RestSurface {
  Cuboid cuboid;
  ElementRange elements;
};

/// Half cells that lie near each other and are covered together.
class RestWindow {
 public:
  /// Around the elements that are required; the others may lie anywhere.
  /// \param elements must outlive the window
  RestWindow(ElementRange elements, const CuboidApproximationParams& params);

  /// What cuboids stand for needs no box: it is no longer required, and the window becomes as small
  /// as the rest allows.
  void leaveTo(const std::vector<CuboidReach>& present) { release(present, true); }
  /// Only what these cuboids stand for needs a box.
  void keepOf(const std::vector<CuboidReach>& boxes) { release(boxes, false); }
  bool anyRequired() const { return required_.count() > 0; }
  /// Boxes may also lie where a cuboid is.
  void allow(const Cuboid& cuboid);

  /// The required cells that each cuboid stands for: those of its own surface and those it is near.
  std::vector<CellSet> cellsOf(const std::vector<RestSurface>& surfaces, double margin) const;

  /// Will any cover by boxes alone need so many? False where that is not known.
  bool needsAtLeast(std::size_t boxes) const;
  /// Few boxes and sets for the required cells.
  /// \param sets    of cells, each of something that may stand for them
  /// \param effort  full: no more than boxes of whole cells need, where half cells are tolerated
  /// \param cuboids are added
  /// \return which of the sets take part, ascending
  std::vector<std::size_t> cover(const std::vector<CellSet>& sets, CoverEffort effort,
                                 std::vector<Cuboid>& cuboids) const;

 private:
  /// \return false outside the window
  bool find(const HalfCell& at, LatticeCell& cell) const;
  Vector3 centerOf(const LatticeCell& cell) const;
  LatticeBox boxAround(const Cuboid& cuboid, double margin) const;
  void release(const std::vector<CuboidReach>& cuboids, bool inside);
  void shrink();
  LatticeBox markCells(const RestSurface& surface, double margin, BitGrid& marks) const;
  BitGrid roomForBoxes() const;
  BoxList coverOfWholeCells() const;
  std::vector<float> probabilities(const CellNumbers& numbers) const;

  ElementRange elements_;
  CoverRules rules_;
  double half_;
  HalfCell low_{};
  BitGrid required_{0, 0, 0};
  BitGrid allowed_{0, 0, 0};
  BitGrid exact_{0, 0, 0};
};

}  // namespace planar_mapping::detail
