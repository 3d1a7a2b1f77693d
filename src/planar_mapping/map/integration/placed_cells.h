// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/map/store/map_data.h"

namespace planar_mapping::detail {

/// Adds a place that holds points to non-planar cells; where they have one, the larger belief is
/// kept.
/// \param point  metres \param s  side of a cell, metres
void addPart(const Vector3& point, double s, std::uint8_t belief, bool is_compact,
             CellLayer& cells);

/// Calls visit(middle, in cells) for the parts of a cell that hold points: its eighths, or the mean
/// of the points where no eighths are kept.
template <typename Visit>
void forEachPartOf(const MapData& map, const CellBlock& block, std::size_t bit, const Int3& cell,
                   Visit&& visit) {
  const Vector3 corner(cell.x, cell.y, cell.z);
  if (!map.isCompact()) {
    const CellBlock::Mean mean = block.mean(bit);
    return visit(corner + (Vector3(mean[0], mean[1], mean[2]) + Vector3::Constant(0.5)) / 256.0);
  }
  forEachBit(block.octants(bit), [&](std::size_t i) {
    visit(corner + Vector3(0.25 + 0.5 * static_cast<double>(i & 1u),
                           0.25 + 0.5 * static_cast<double>(i >> 1u & 1u),
                           0.25 + 0.5 * static_cast<double>(i >> 2u)));
  });
}

}  // namespace planar_mapping::detail
