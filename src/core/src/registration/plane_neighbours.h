// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "registration/surface_cells.h"

namespace planar_mapping::detail {

/// Planes or lines for a search within a distance, in cells of that size.
class PlaneNeighbours {
 public:
  /// \param reach  of the search, metres, > 0
  PlaneNeighbours(std::vector<Surfel> planes, double reach, CellShape shape);

  /// The next plane within \p reach that faces the same way, or null; lines
  /// have no side. \param reach  at most that of the constructor
  const Surfel* nearest(const Vector3& point, const Vector3& normal, double reach,
                        double min_cosine) const;

 private:
  double reach_;
  CellShape shape_;
  std::vector<Surfel> planes_;
  CellTable cells_;
  std::vector<std::vector<std::uint32_t>> members_;  ///< planes in each cell
};

}  // namespace planar_mapping::detail
