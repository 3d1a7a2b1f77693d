// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/cuboids/cover/bit_grid.h"

namespace planar_mapping::detail {

using BoxList = std::vector<LatticeBox>;

/// What a cover may do, per axis, in cells of the lattice.
struct CoverRules {
  /// A box stands for the cells that lie this far beyond it too, 0 or 1.
  std::array<std::int32_t, 3> tolerance{};
  std::array<std::int32_t, 3> smallest{1, 1, 1};  ///< least size of a box
};

using AxisOrder = std::array<std::size_t, 3>;
constexpr std::array<AxisOrder, 6> kAxisOrders = {AxisOrder{0, 1, 2}, AxisOrder{1, 0, 2},
                                                  AxisOrder{2, 0, 1}, AxisOrder{0, 2, 1},
                                                  AxisOrder{1, 2, 0}, AxisOrder{2, 1, 0}};

inline LatticeBox boxOf(const LatticeCell& c) {
  return {c, {c[0] + 1, c[1] + 1, c[2] + 1}};
}

inline LatticeBox grown(const LatticeBox& box, const std::array<std::int32_t, 3>& by) {
  LatticeBox b = box;
  for (std::size_t k = 0; k < 3; ++k) {
    b.low[k] -= by[k];
    b.high[k] += by[k];
  }
  return b;
}

inline void include(LatticeBox& hull, const LatticeBox& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    hull.low[k] = std::min(hull.low[k], other.low[k]);
    hull.high[k] = std::max(hull.high[k], other.high[k]);
  }
}

inline std::int64_t volume(const LatticeBox& box) {
  return static_cast<std::int64_t>(box.size(0)) * box.size(1) * box.size(2);
}

inline bool meet(const LatticeBox& l, const LatticeBox& r) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (l.low[k] >= r.high[k] || r.low[k] >= l.high[k]) return false;
  }
  return true;
}

/// The cells that are on, by z, y, x.
inline std::vector<LatticeCell> listCells(const BitGrid& grid) {
  std::vector<LatticeCell> cells;
  cells.reserve(static_cast<std::size_t>(grid.count()));
  grid.forEach(grid.window(), [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    cells.push_back({x, y, z});
  });
  return cells;
}

/// Calls visit(box) for the least boxes of allowed cells that stand for all of \p need, until it
/// returns false.
template <typename Visit>
void forEachFit(const BitGrid& allowed, const CoverRules& rules, const LatticeBox& need,
                Visit&& visit) {
  LatticeCell first{}, last{}, size{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t t = rules.tolerance[k];
    size[k] = std::max(need.size(k) - 2 * t, rules.smallest[k]);
    first[k] = need.high[k] - t - size[k];
    last[k] = need.low[k] + t;
  }
  LatticeBox box;
  for (std::int32_t z = first[2]; z <= last[2]; ++z) {
    for (std::int32_t y = first[1]; y <= last[1]; ++y) {
      for (std::int32_t x = first[0]; x <= last[0]; ++x) {
        box.low = {x, y, z};
        for (std::size_t k = 0; k < 3; ++k) box.high[k] = box.low[k] + size[k];
        if (allowed.all(box) && !visit(box)) return;
      }
    }
  }
}

/// Is there a box of allowed cells that stands for all of \p need?
inline bool fits(const BitGrid& allowed, const CoverRules& rules, const LatticeBox& need) {
  bool found = false;
  forEachFit(allowed, rules, need, [&](const LatticeBox&) {
    found = true;
    return false;
  });
  return found;
}

/// The boxes of allowed cells that grow from the required cells along the axes in each of the six
/// orders, each once, ascending; those that are not too small.
std::vector<LatticeBox> largestBoxes(const BitGrid& required, const BitGrid& allowed,
                                     const CoverRules& rules);

/// Of the least boxes of allowed cells that stand for all of \p need the one that holds most of it;
/// on whole cells if there is a choice; \p need itself if none has room.
LatticeBox drawnBackTo(const LatticeBox& need, const BitGrid& required, const BitGrid& allowed,
                       const CoverRules& rules);

/// A number of boxes of allowed cells that no cover of the required ones can do without: that many
/// cells are found of which no two have a box in common. The search stops at \p enough.
std::size_t fewestBoxes(const BitGrid& required, const BitGrid& allowed, const CoverRules& rules,
                        std::size_t enough);

}  // namespace planar_mapping::detail
