// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "box_cover.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

namespace planar_mapping::detail {
namespace {

using AxisOrder = std::array<std::size_t, 3>;

constexpr std::array<AxisOrder, 6> kAxisOrders = {AxisOrder{0, 1, 2}, AxisOrder{1, 0, 2},
                                                  AxisOrder{2, 0, 1}, AxisOrder{0, 2, 1},
                                                  AxisOrder{1, 2, 0}, AxisOrder{2, 1, 0}};

/// Visits the positions of the box's cells (-1 = not in the list) until visit returns false.
template <typename Visit>
bool forEachCell(const CellLookup& lookup, const CellBox& box, const Visit& visit) {
  for (std::int32_t z = 0; z < box.size[2]; ++z) {
    for (std::int32_t y = 0; y < box.size[1]; ++y) {
      for (std::int32_t x = 0; x < box.size[0]; ++x) {
        if (!visit(lookup.at(box.low[0] + x, box.low[1] + y, box.low[2] + z))) return false;
      }
    }
  }
  return true;
}

class BoxCover {
 public:
  BoxCover(const std::vector<CellKey>& cells, const CellLookup& lookup,
           const std::vector<char>& needed)
      : cells_(cells), lookup_(lookup), needed_(needed), covers_(cells.size(), 0) {}

  std::vector<CellBox> run() {
    for (const std::int32_t seed : seeds()) {
      if (covers_[static_cast<std::size_t>(seed)] > 0) continue;
      const CellBox box = bestFrom(cells_[static_cast<std::size_t>(seed)]);
      forEachCell(lookup_, box, [&](std::int32_t i) {
        ++covers_[static_cast<std::size_t>(i)];
        return true;
      });
      boxes_.push_back(box);
    }
    removeSuperfluous();
    return std::move(boxes_);
  }

 private:
  /// Needed cells, those with the fewest neighbours first: they leave the least choice.
  std::vector<std::int32_t> seeds() const {
    std::vector<std::tuple<int, CellKey, std::int32_t>> ranked;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (!needed_[i]) continue;
      int neighbours = 0;
      for (int d = -1; d <= 1; d += 2) {
        neighbours += lookup_.neighbour(cells_[i], d, 0, 0) >= 0;
        neighbours += lookup_.neighbour(cells_[i], 0, d, 0) >= 0;
        neighbours += lookup_.neighbour(cells_[i], 0, 0, d) >= 0;
      }
      ranked.emplace_back(neighbours, cells_[i], static_cast<std::int32_t>(i));
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::int32_t> order;
    order.reserve(ranked.size());
    for (const auto& entry : ranked) order.push_back(std::get<2>(entry));
    return order;
  }

  CellBox bestFrom(const CellKey& seed) const {
    CellBox best;
    std::int64_t most = 0;
    for (const AxisOrder& order : kAxisOrders) {
      CellBox box{seed, {1, 1, 1}};
      for (const std::size_t axis : order) {
        while (grows(box, axis, true)) ++box.size[axis];
        while (grows(box, axis, false)) {
          --box.low[axis];
          ++box.size[axis];
        }
      }
      std::int64_t gain = 0;
      forEachCell(lookup_, box, [&](std::int32_t i) {
        const auto k = static_cast<std::size_t>(i);
        gain += needed_[k] && covers_[k] == 0;
        return true;
      });
      if (gain > most) {
        most = gain;
        best = box;
      }
    }
    return best;
  }

  bool grows(const CellBox& box, std::size_t axis, bool upwards) const {
    CellBox layer = box;
    const std::int64_t position = upwards
                                      ? static_cast<std::int64_t>(box.low[axis]) + box.size[axis]
                                      : static_cast<std::int64_t>(box.low[axis]) - 1;
    if (position > INT32_MAX || position < INT32_MIN) return false;
    layer.low[axis] = static_cast<std::int32_t>(position);
    layer.size[axis] = 1;
    return forEachCell(lookup_, layer, [](std::int32_t i) { return i >= 0; });
  }

  /// A box whose needed cells are all covered by others as well; small boxes are asked first.
  void removeSuperfluous() {
    std::vector<std::size_t> order(boxes_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto volume = [&](std::size_t i) {
      const CellKey& size = boxes_[i].size;
      return static_cast<std::int64_t>(size[0]) * size[1] * size[2];
    };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t l, std::size_t r) { return volume(l) < volume(r); });
    std::vector<char> keep(boxes_.size(), 1);
    for (const std::size_t i : order) {
      keep[i] = !forEachCell(lookup_, boxes_[i], [&](std::int32_t cell) {
        const auto k = static_cast<std::size_t>(cell);
        return !needed_[k] || covers_[k] > 1;
      });
      if (keep[i]) continue;
      forEachCell(lookup_, boxes_[i], [&](std::int32_t cell) {
        --covers_[static_cast<std::size_t>(cell)];
        return true;
      });
    }
    std::vector<CellBox> left;
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      if (keep[i]) left.push_back(boxes_[i]);
    }
    boxes_ = std::move(left);
  }

  const std::vector<CellKey>& cells_;
  const CellLookup& lookup_;
  const std::vector<char>& needed_;
  std::vector<std::int32_t> covers_;  ///< number of boxes over each cell
  std::vector<CellBox> boxes_;
};

}  // namespace

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
    sparse_ = CellIndex(cells);
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

void leaveFringeToNeighbours(const std::vector<CellKey>& cells, const CellLookup& lookup,
                             const std::vector<std::uint8_t>& octants,
                             const std::vector<float>& weight, std::vector<char>& needed) {
  // Octants in the lower and in the upper half along each axis.
  constexpr std::array<unsigned, 3> kLower = {0x55, 0x33, 0x0F};
  std::vector<std::int32_t> order;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (needed[i]) order.push_back(static_cast<std::int32_t>(i));
  }
  std::sort(order.begin(), order.end(), [&](std::int32_t l, std::int32_t r) {
    const auto i = static_cast<std::size_t>(l);
    const auto j = static_cast<std::size_t>(r);
    return std::tie(weight[i], cells[i]) < std::tie(weight[j], cells[j]);
  });
  std::vector<char> relied_upon(cells.size(), 0);
  for (const std::int32_t number : order) {
    const auto i = static_cast<std::size_t>(number);
    if (relied_upon[i]) continue;
    std::array<int, 3> side{};  // the half that holds all points, 0 = both do
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((octants[i] & ~kLower[axis] & 0xFFu) == 0) side[axis] = -1;
      if ((octants[i] & kLower[axis]) == 0) side[axis] = 1;
    }
    // Neighbours across faces first, then edges, then the corner.
    for (const unsigned axes : {1u, 2u, 4u, 3u, 5u, 6u, 7u}) {
      std::array<int, 3> d{};
      bool possible = true;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!(axes >> axis & 1u)) continue;
        d[axis] = side[axis];
        possible &= side[axis] != 0;
      }
      if (!possible) continue;
      const std::int32_t other = lookup.neighbour(cells[i], d[0], d[1], d[2]);
      if (other < 0 || !needed[static_cast<std::size_t>(other)]) continue;
      needed[i] = 0;
      relied_upon[static_cast<std::size_t>(other)] = 1;
      break;
    }
  }
}

std::vector<CellBox> coverWithBoxes(const std::vector<CellKey>& cells, const CellLookup& lookup,
                                    const std::vector<char>& needed) {
  return BoxCover(cells, lookup, needed).run();
}

}  // namespace planar_mapping::detail
