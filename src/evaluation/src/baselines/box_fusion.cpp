// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>

#include "planar_mapping/evaluation/rectangular_approximation.h"

namespace planar_mapping {
namespace evaluation {
namespace {

struct Box {
  std::array<std::int32_t, 3> low;
  std::array<std::int32_t, 3> size;
  std::uint32_t part;  ///< that hangs together across faces; boxes of two parts never fuse

  std::int64_t end(std::size_t axis) const { return std::int64_t{low[axis]} + size[axis]; }
};

using AxisOrder = std::array<std::size_t, 3>;
constexpr std::array<AxisOrder, 6> kAxisOrders = {AxisOrder{0, 1, 2}, AxisOrder{1, 0, 2},
                                                  AxisOrder{2, 0, 1}, AxisOrder{0, 2, 1},
                                                  AxisOrder{1, 2, 0}, AxisOrder{2, 1, 0}};

/// Brings boxes that may form runs along the axis next to each other, in their order.
void sortIntoRuns(std::vector<Box>& boxes, std::size_t axis) {
  const std::size_t u = (axis + 1) % 3;
  const std::size_t v = (axis + 2) % 3;
  const auto key = [axis, u, v](const Box& b) {
    return std::tie(b.low[u], b.low[v], b.size[u], b.size[v], b.low[axis]);
  };
  std::sort(boxes.begin(), boxes.end(),
            [&key](const Box& a, const Box& b) { return key(a) < key(b); });
}

/// Is \p b right behind \p a along the axis, and do they share a complete face?
bool follows(const Box& a, const Box& b, std::size_t axis) {
  const std::size_t u = (axis + 1) % 3;
  const std::size_t v = (axis + 2) % 3;
  return a.low[u] == b.low[u] && a.low[v] == b.low[v] && a.size[u] == b.size[u] &&
         a.size[v] == b.size[v] && a.end(axis) == b.low[axis];
}

/// Fuses all runs along one axis; false if there was none.
bool fuseRuns(std::vector<Box>& boxes, std::size_t axis) {
  sortIntoRuns(boxes, axis);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (kept > 0 && follows(boxes[kept - 1], boxes[i], axis)) {
      boxes[kept - 1].size[axis] += boxes[i].size[axis];
    } else {
      boxes[kept++] = boxes[i];
    }
  }
  const bool fused = kept < boxes.size();
  boxes.resize(kept);
  return fused;
}

std::vector<Box> fuse(std::vector<Box> boxes, const AxisOrder& order) {
  for (bool fused = true; fused;) {
    fused = false;
    for (const std::size_t axis : order) fused = fuseRuns(boxes, axis) || fused;
  }
  return boxes;
}

/// Numbers the parts of single cells that hang together across faces. \return how many there are
std::uint32_t numberParts(std::vector<Box>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i].part = static_cast<std::uint32_t>(i);
  std::vector<std::uint32_t> parent(cells.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&parent](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sortIntoRuns(cells, axis);
    for (std::size_t i = 1; i < cells.size(); ++i)
      if (follows(cells[i - 1], cells[i], axis))
        parent[root(cells[i].part)] = root(cells[i - 1].part);
  }
  std::uint32_t parts = 0;
  std::vector<std::uint32_t> number(cells.size());
  for (std::uint32_t i = 0; i < parent.size(); ++i)
    if (parent[i] == i) number[i] = parts++;
  for (Box& cell : cells) cell.part = number[root(cell.part)];
  return parts;
}

}  // namespace

std::vector<GridBox> fuseCells(const std::vector<GridCell>& cells) {
  std::vector<GridCell> distinct = cells;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  std::vector<Box> single;
  single.reserve(distinct.size());
  for (const GridCell& cell : distinct) single.push_back({{cell.x, cell.y, cell.z}, {1, 1, 1}, 0});
  const std::uint32_t parts = numberParts(single);

  std::array<std::vector<Box>, kAxisOrders.size()> results;
  std::vector<std::size_t> fewest(parts, single.size() + 1);
  std::vector<std::size_t> best_order(parts, 0);
  for (std::size_t order = 0; order < kAxisOrders.size(); ++order) {
    results[order] = fuse(single, kAxisOrders[order]);
    std::vector<std::size_t> count(parts, 0);
    for (const Box& box : results[order]) ++count[box.part];
    for (std::uint32_t part = 0; part < parts; ++part) {
      if (count[part] >= fewest[part]) continue;
      fewest[part] = count[part];
      best_order[part] = order;
    }
  }
  std::vector<GridBox> boxes;
  for (std::size_t order = 0; order < kAxisOrders.size(); ++order) {
    for (const Box& box : results[order]) {
      if (best_order[box.part] != order) continue;
      boxes.push_back(
          {{box.low[0], box.low[1], box.low[2]}, {box.size[0], box.size[1], box.size[2]}});
    }
  }
  std::sort(boxes.begin(), boxes.end(),
            [](const GridBox& a, const GridBox& b) { return a.low < b.low; });
  return boxes;
}

}  // namespace evaluation
}  // namespace planar_mapping
