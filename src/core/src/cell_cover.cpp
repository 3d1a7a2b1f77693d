// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/cell_cover.h"

#include <algorithm>

#include "box_cover.h"

namespace planar_mapping {

std::vector<LatticeBox> coverCells(const std::vector<LatticeCell>& cells) {
  std::vector<LatticeCell> distinct = cells;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  const detail::CellLookup lookup(distinct);
  std::vector<LatticeBox> boxes;
  for (const detail::CellBox& box :
       detail::coverWithBoxes(distinct, lookup, std::vector<char>(distinct.size(), 1))) {
    boxes.push_back({box.low, box.size});
  }
  return boxes;
}

}  // namespace planar_mapping
