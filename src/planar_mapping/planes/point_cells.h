// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/point_sums.h"
#include "planar_mapping/grid/cell_table.h"

namespace planar_mapping::detail {

/// Points of a cloud in cubic cells. Cells lie on absolute multiples of their side, so a cell
/// depends on no other point; coordinates beyond 2^30 cells belong to none.
struct PointCells {
  double side = 0.0;
  CellTable table;
  std::vector<PointSums> sums;        ///< per cell, about its centre
  std::vector<std::int32_t> cell_of;  ///< per point considered, -1 = none
  std::size_t points_not_measured = 0;

  Vector3 centre(std::size_t cell) const {
    const CellKey& key = table.key(cell);
    return Vector3(key.x + 0.5, key.y + 0.5, key.z + 0.5) * side;
  }
};

/// Side of the cells, \p smallest or that doubled until the given fraction of a sample of every 8th
/// point is not alone in its cell: 0.75 means about 11 points in a cell.
double chooseCellSide(const PointsView& points, const Indices* indices, double smallest,
                      double fraction_in_company);

PointCells buildPointCells(const PointsView& points, const Indices* indices, double side);

}  // namespace planar_mapping::detail
