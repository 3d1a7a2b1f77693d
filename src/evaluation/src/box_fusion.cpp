// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

#include "planar_mapping/evaluation/rectangular_approximation.h"

namespace planar_mapping {
namespace evaluation {
namespace {

struct Box {
  std::array<std::int32_t, 3> low;
  std::array<std::int32_t, 3> size;
};

using AxisOrder = std::array<std::size_t, 3>;
constexpr std::array<AxisOrder, 6> kAxisOrders = {AxisOrder{0, 1, 2}, AxisOrder{1, 0, 2},
                                                  AxisOrder{2, 0, 1}, AxisOrder{0, 2, 1},
                                                  AxisOrder{1, 2, 0}, AxisOrder{2, 1, 0}};

/// Fuses all runs along one axis; false if there was none.
bool fuseRuns(std::vector<Box>& boxes, std::size_t axis) {
  const std::size_t u = (axis + 1) % 3;
  const std::size_t v = (axis + 2) % 3;
  const auto inARow = [u, v](const Box& a, const Box& b) {
    return a.low[u] == b.low[u] && a.low[v] == b.low[v] && a.size[u] == b.size[u] &&
           a.size[v] == b.size[v];
  };
  std::sort(boxes.begin(), boxes.end(), [axis, u, v](const Box& a, const Box& b) {
    if (a.low[u] != b.low[u]) return a.low[u] < b.low[u];
    if (a.low[v] != b.low[v]) return a.low[v] < b.low[v];
    if (a.size[u] != b.size[u]) return a.size[u] < b.size[u];
    if (a.size[v] != b.size[v]) return a.size[v] < b.size[v];
    return a.low[axis] < b.low[axis];
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (kept > 0) {
      Box& last = boxes[kept - 1];
      if (inARow(last, boxes[i]) && last.low[axis] + last.size[axis] == boxes[i].low[axis]) {
        last.size[axis] += boxes[i].size[axis];
        continue;
      }
    }
    boxes[kept++] = boxes[i];
  }
  const bool fused = kept < boxes.size();
  boxes.resize(kept);
  return fused;
}

std::vector<Box> fuse(std::vector<Box> boxes, const AxisOrder& order) {
  bool fused = true;
  while (fused) {
    fused = false;
    for (const std::size_t axis : order) fused = fuseRuns(boxes, axis) || fused;
  }
  return boxes;
}

}  // namespace

std::vector<GridBox> fuseCells(const std::vector<GridCell>& cells) {
  std::vector<GridCell> distinct = cells;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  std::vector<Box> single;
  single.reserve(distinct.size());
  for (const GridCell& cell : distinct) single.push_back({{cell.x, cell.y, cell.z}, {1, 1, 1}});
  std::vector<Box> best;
  for (const AxisOrder& order : kAxisOrders) {
    std::vector<Box> boxes = fuse(single, order);
    if (&order == &kAxisOrders.front() || boxes.size() < best.size()) best = std::move(boxes);
  }
  std::vector<GridBox> result;
  result.reserve(best.size());
  for (const Box& box : best) {
    result.push_back(
        {{box.low[0], box.low[1], box.low[2]}, {box.size[0], box.size[1], box.size[2]}});
  }
  std::sort(result.begin(), result.end(),
            [](const GridBox& a, const GridBox& b) { return a.low < b.low; });
  return result;
}

}  // namespace evaluation
}  // namespace planar_mapping
