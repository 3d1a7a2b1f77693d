// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/cuboids/compact_cover.h"
#include "planar_mapping/cuboids/cover/lattice_cover.h"

namespace planar_mapping::detail {

using HalfCell = std::array<std::int64_t, 3>;  ///< x, y, z, each within 2^32 of 0
using HalfCellBox = Eigen::AlignedBox<std::int64_t, 3>;

inline void include(HalfCellBox& box, const HalfCell& at) {
  box.extend(Eigen::Map<const HalfCellBox::VectorType>(at.data()));
}

/// What a half cell holds. Of several in one half cell those that are required count, and of these
/// the exact ones, if there are any; of them the one that is believed most.
struct Element {
  HalfCell at{};
  float probability = 1.0f;
  bool required = false;
  bool exact = false;  ///< holds points anywhere in it, not those of a surface alone
};

/// Points beyond all half cells, or not finite, are left out.
void addElements(const std::vector<SurfacePiece>& pieces, double half,
                 std::vector<Element>& elements);

/// Those of cells with enough points, and where boxes may lie because a cell needs none.
void addElements(const std::vector<NonPlanarCell>& cells, bool tolerant, int min_points,
                 std::vector<Element>& elements);

/// A cuboid with all that lies within a margin of its faces, made ready for many questions.
class CuboidReach {
 public:
  CuboidReach(const Cuboid& c, double margin)
      : to_local_(c.orientation.conjugate().toRotationMatrix()),
        offset_(-(to_local_ * c.center)),
        extent_(0.5 * c.size + Vector3::Constant(margin + 1e-9 * (1.0 + c.center.norm()))) {}

  bool holds(const Vector3& p) const { return (place(p).array() <= extent_.array()).all(); }
  /// False only if it holds nothing within \p radius of the point.
  bool mayReach(const Vector3& p, double radius) const {
    return ((place(p) - extent_).array() <= radius).all();
  }

 private:
  Vector3 place(const Vector3& p) const { return (to_local_ * p + offset_).cwiseAbs(); }

  Matrix3 to_local_;
  Vector3 offset_;
  Vector3 extent_;
};

/// Elements next to each other in memory.
struct ElementRange {
  const Element* first = nullptr;
  const Element* last = nullptr;

  const Element* begin() const { return first; }
  const Element* end() const { return last; }
};

/// A cuboid that boxes may take the place of, with the elements of its own surface.
struct WindowSurface {
  Cuboid cuboid;
  ElementRange elements;
};

/// Half cells that lie near each other and are covered together.
class CoverWindow {
 public:
  /// Around the elements that are required; the others may lie anywhere.
  /// \param elements must outlive the window
  CoverWindow(ElementRange elements, const CuboidApproximationParams& params);

  /// What cuboids stand for needs no box: it is no longer required, and the window becomes as small
  /// as the rest allows.
  void leaveTo(const std::vector<CuboidReach>& present) { release(present, true); }
  /// Only what these cuboids stand for needs a box.
  void keepOf(const std::vector<CuboidReach>& boxes) { release(boxes, false); }
  bool anyRequired() const { return required_.count() > 0; }
  /// Boxes may also lie where a cuboid is.
  void allow(const Cuboid& cuboid);

  /// The required cells that each cuboid stands for: those of its own surface and those it is near.
  std::vector<CellSet> cellsOf(const std::vector<WindowSurface>& surfaces, double margin) const;

  /// Will any cover by boxes alone need so many? False where that is not known.
  bool needsAtLeast(std::size_t boxes) const;
  /// Few boxes and sets for the required cells.
  /// \param sets    of cells, each of something that may stand for them
  /// \param effort  full: fewer boxes are searched for
  /// \param cuboids are added
  /// \return which of the sets take part, ascending; nothing for clutter, of which boxes are not
  ///         searched for (sweptOver())
  std::optional<std::vector<std::size_t>> cover(const std::vector<CellSet>& sets,
                                                CoverEffort effort,
                                                std::vector<Cuboid>& cuboids) const;

 private:
  /// \return false outside the window
  bool find(const HalfCell& at, LatticeCell& cell) const;
  Vector3 centerOf(const LatticeCell& cell) const;
  LatticeBox boxAround(const Cuboid& cuboid, double margin) const;
  void release(const std::vector<CuboidReach>& cuboids, bool inside);
  void shrink();
  LatticeBox markCells(const WindowSurface& surface, double margin, BitGrid& marks) const;
  BitGrid roomForBoxes() const;
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
