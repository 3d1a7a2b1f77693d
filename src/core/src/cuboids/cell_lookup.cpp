// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/cell_lookup.h"

#include <algorithm>

namespace planar_mapping::detail {

CellLookup::CellLookup(const std::vector<CellKey>& cells) {
  if (cells.empty()) return;
  constexpr double kSmallVolume = 4096.0;
  constexpr double kVolumePerCell = 256.0;
  low_ = cells.front();
  CellKey high = low_;
  for (const CellKey& cell : cells) {
    for (std::size_t k = 0; k < 3; ++k) {
      low_[k] = std::min(low_[k], cell[k]);
      high[k] = std::max(high[k], cell[k]);
    }
  }
  double volume = 1.0;
  for (std::size_t k = 0; k < 3; ++k) volume *= static_cast<double>(high[k]) - low_[k] + 1.0;
  if (volume > kSmallVolume + kVolumePerCell * static_cast<double>(cells.size())) {
    sparse_ = CellNumbering(cells);
    return;
  }
  for (std::size_t k = 0; k < 3; ++k) size_[k] = static_cast<std::uint32_t>(high[k] - low_[k]) + 1;
  dense_.assign(static_cast<std::size_t>(volume), -1);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto dx = static_cast<std::size_t>(cells[i][0] - low_[0]);
    const auto dy = static_cast<std::size_t>(cells[i][1] - low_[1]);
    const auto dz = static_cast<std::size_t>(cells[i][2] - low_[2]);
    dense_[(dz * size_[1] + dy) * size_[0] + dx] = static_cast<std::int32_t>(i);
  }
}

std::vector<std::int32_t> connectedComponents(const std::vector<CellKey>& cells,
                                              const CellLookup& lookup) {
  std::vector<std::int32_t> component(cells.size(), -1);
  std::vector<std::int32_t> queue;
  std::int32_t count = 0;
  for (std::size_t start = 0; start < cells.size(); ++start) {
    if (component[start] >= 0) continue;
    component[start] = count;
    queue.assign(1, static_cast<std::int32_t>(start));
    while (!queue.empty()) {
      const CellKey cell = cells[static_cast<std::size_t>(queue.back())];
      queue.pop_back();
      for (int code = 0; code < 27; ++code) {
        const std::int32_t i = lookup.neighbour(cell, code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
        if (i < 0 || component[static_cast<std::size_t>(i)] >= 0) continue;
        component[static_cast<std::size_t>(i)] = count;
        queue.push_back(i);
      }
    }
    ++count;
  }
  return component;
}

}  // namespace planar_mapping::detail
