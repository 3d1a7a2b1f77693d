// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "planar_mapping/core/geometry/cuboid.h"

namespace planar_mapping::detail {

/// A box of a region, as it is covered by itself.
struct RegionBox {
  std::uint64_t region = 0;  ///< CellLayer::regionKey()
  std::uint32_t number = 0;  ///< among those of the region

  bool operator==(const RegionBox& o) const { return region == o.region && number == o.number; }
  bool operator<(const RegionBox& o) const {
    return region != o.region ? region < o.region : number < o.number;
  }
};

/// Groups of boxes of several regions that one cover may do better: those that hang together, so
/// near each other that boxes may take over what others stand for. Where too many do, only those
/// that meet at a face between two regions. What is near a group decides, not the order in which
/// regions were covered.
/// \param boxes with axes of the world, on the lattice of half cells; ascending by region and
/// number \return their positions, ascending; groups by their first box
std::vector<std::vector<std::uint32_t>> groupAcrossBorders(
    const std::vector<std::pair<RegionBox, Cuboid>>& boxes, double cell);

}  // namespace planar_mapping::detail
