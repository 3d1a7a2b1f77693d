// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace planar_mapping {

/// Numbered things, united to parts.
class DisjointParts {
 public:
  explicit DisjointParts(std::size_t things) : parent_(things) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  /// The part of \p a takes the number of that of \p b.
  void unite(std::uint32_t a, std::uint32_t b) { parent_[of(a)] = of(b); }
  /// The number of the part: that of one of its things.
  std::uint32_t of(std::uint32_t thing) {
    while (parent_[thing] != thing) thing = parent_[thing] = parent_[parent_[thing]];
    return thing;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace planar_mapping
