// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/core/cuboids/cuboid_approximation.h"
#include "cuboids/plane_cells.h"

namespace planar_mapping::detail {

/// The volume that planar cuboids take, grown by a margin, for many quick questions.
class PlanarVolume {
 public:
  /// \param resolution side of a cell of the masks that are added
  /// \param margin metres, at most one cell
  PlanarVolume(double resolution, double thickness, double margin)
      : cells_per_metre_(1.0 / resolution),
        margin_cells_(margin / resolution),
        margin_(margin),
        thickness_(thickness) {}

  void add(const PlaneFrame& frame, const std::vector<CellRectangle>& rectangles);

  /// Patches that may hold points of the ball, appended to \p patches.
  void candidates(const Vector3& center, double radius, std::vector<std::int32_t>& patches) const;

  /// Takes the marks off those quarters along the border of \p patch that the volume holds: they
  /// need no rectangle of their own.
  /// \param s side of a cell of the patch, metres
  void clearCovered(PlanePatch& patch, double s) const;

  /// Does the patch hold the point?
  bool contains(std::int32_t patch, const Vector3& point) const;

 private:
  struct Patch {
    PlaneFrame frame;
    CellMask covered;
    double width = 0.0;  ///< metres
    double height = 0.0;
  };

  double cells_per_metre_;
  double margin_cells_;
  double margin_;
  double thickness_;
  std::vector<Patch> patches_;
};

}  // namespace planar_mapping::detail
