// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "box_cover.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace planar_mapping::detail {
namespace {

using AxisOrder = std::array<std::size_t, 3>;

constexpr std::array<AxisOrder, 6> kAxisOrders = {AxisOrder{0, 1, 2}, AxisOrder{1, 0, 2},
                                                  AxisOrder{2, 0, 1}, AxisOrder{0, 2, 1},
                                                  AxisOrder{1, 2, 0}, AxisOrder{2, 1, 0}};

/// Takes the first free cell, grows it along the first axis of the order as far as cells are free,
/// then along the second, then along the third.
class GreedyCover {
 public:
  GreedyCover(const std::vector<CellKey>& cells, const CellIndex& index)
      : cells_(cells), index_(index), box_of_cell(cells.size(), -1) {}

  /// \param members positions of the component's cells
  std::vector<CellBox> cover(std::vector<std::int32_t> members, const AxisOrder& order) {
    std::sort(members.begin(), members.end(), [&](std::int32_t l, std::int32_t r) {
      const CellKey& a = cells_[static_cast<std::size_t>(l)];
      const CellKey& b = cells_[static_cast<std::size_t>(r)];
      for (std::size_t i = 3; i-- > 0;) {
        if (a[order[i]] != b[order[i]]) return a[order[i]] < b[order[i]];
      }
      return false;
    });
    for (const std::int32_t m : members) box_of_cell[static_cast<std::size_t>(m)] = -1;
    std::vector<CellBox> boxes;
    for (const std::int32_t m : members) {
      if (box_of_cell[static_cast<std::size_t>(m)] >= 0) continue;
      CellBox box{cells_[static_cast<std::size_t>(m)], {1, 1, 1}};
      for (const std::size_t axis : order) {
        while (layerIsFree(box, axis)) ++box.size[axis];
      }
      mark(box, static_cast<std::int32_t>(boxes.size()));
      boxes.push_back(box);
    }
    return boxes;
  }

 private:
  template <typename Visit>
  static bool forEachCell(const CellBox& box, const Visit& visit) {
    for (std::int32_t z = 0; z < box.size[2]; ++z) {
      for (std::int32_t y = 0; y < box.size[1]; ++y) {
        for (std::int32_t x = 0; x < box.size[0]; ++x) {
          if (!visit(CellKey{box.low[0] + x, box.low[1] + y, box.low[2] + z})) return false;
        }
      }
    }
    return true;
  }

  bool layerIsFree(const CellBox& box, std::size_t axis) const {
    CellBox layer = box;
    if (static_cast<std::int64_t>(box.low[axis]) + box.size[axis] > INT32_MAX) return false;
    layer.low[axis] += box.size[axis];
    layer.size[axis] = 1;
    return forEachCell(layer, [&](const CellKey& cell) {
      const std::int32_t i = index_.at(cell);
      return i >= 0 && box_of_cell[static_cast<std::size_t>(i)] < 0;
    });
  }

  void mark(const CellBox& box, std::int32_t id) {
    forEachCell(box, [&](const CellKey& cell) {
      box_of_cell[static_cast<std::size_t>(index_.at(cell))] = id;
      return true;
    });
  }

  const std::vector<CellKey>& cells_;
  const CellIndex& index_;

 public:
  std::vector<std::int32_t> box_of_cell;  ///< within the component covered last
};

}  // namespace

std::vector<std::int32_t> connectedComponents(const std::vector<CellKey>& cells,
                                              const CellIndex& index) {
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
        CellKey other = cell;
        if (!step(other, 0, code % 3 - 1) || !step(other, 1, code / 3 % 3 - 1) ||
            !step(other, 2, code / 9 - 1)) {
          continue;
        }
        const std::int32_t i = index.at(other);
        if (i < 0 || component[static_cast<std::size_t>(i)] >= 0) continue;
        component[static_cast<std::size_t>(i)] = count;
        queue.push_back(i);
      }
    }
    ++count;
  }
  return component;
}

std::vector<CellBox> coverWithBoxes(const std::vector<CellKey>& cells,
                                    std::vector<std::int32_t>* box_of_cell) {
  const CellIndex index(cells);
  const std::vector<std::int32_t> component = connectedComponents(cells, index);
  std::vector<std::vector<std::int32_t>> members;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto c = static_cast<std::size_t>(component[i]);
    if (c >= members.size()) members.resize(c + 1);
    members[c].push_back(static_cast<std::int32_t>(i));
  }
  if (box_of_cell) box_of_cell->assign(cells.size(), -1);
  GreedyCover greedy(cells, index);
  std::vector<CellBox> boxes;
  for (const std::vector<std::int32_t>& component_cells : members) {
    std::vector<CellBox> best;
    const AxisOrder* best_order = nullptr;
    for (const AxisOrder& order : kAxisOrders) {
      std::vector<CellBox> cover = greedy.cover(component_cells, order);
      if (!best_order || cover.size() < best.size()) {
        best = std::move(cover);
        best_order = &order;
      }
      if (best.size() == 1) break;
    }
    if (box_of_cell) {
      greedy.cover(component_cells, *best_order);
      for (const std::int32_t m : component_cells) {
        (*box_of_cell)[static_cast<std::size_t>(m)] =
            greedy.box_of_cell[static_cast<std::size_t>(m)] +
            static_cast<std::int32_t>(boxes.size());
      }
    }
    boxes.insert(boxes.end(), best.begin(), best.end());
  }
  return boxes;
}

}  // namespace planar_mapping::detail
