// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <numeric>
#include <vector>

namespace planar_mapping::detail {

/// Numbered cells, united to parts.
class CellParts {
 public:
  explicit CellParts(std::size_t cells) : parent_(cells) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  void unite(std::uint32_t a, std::uint32_t b) { parent_[of(a)] = of(b); }
  /// The number of one of the cells of the part.
  std::uint32_t of(std::uint32_t cell) {
    while (parent_[cell] != cell) cell = parent_[cell] = parent_[parent_[cell]];
    return cell;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace planar_mapping::detail
