// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/evaluation/detail/cell_table.h"
#include "planar_mapping/evaluation/rectangular_approximation.h"

namespace planar_mapping {
namespace evaluation {
namespace {

using AxisOrder = std::array<std::size_t, 3>;

constexpr std::array<AxisOrder, 6> kAxisOrders = {AxisOrder{0, 1, 2}, AxisOrder{1, 0, 2},
                                                  AxisOrder{2, 0, 1}, AxisOrder{0, 2, 1},
                                                  AxisOrder{1, 2, 0}, AxisOrder{2, 1, 0}};

using Coordinates = std::array<std::int32_t, 3>;

struct Box {
  Coordinates low;
  Coordinates size;

  std::int64_t cells() const { return std::int64_t{1} * size[0] * size[1] * size[2]; }
};

class BoxCover {
 public:
  /// \param cells  distinct, ascending
  explicit BoxCover(const std::vector<GridCell>& cells) : covers_(cells.size(), 0) {
    for (const GridCell& cell : cells) {
      numbers_[detail::packCell(cell.x, cell.y, cell.z)] =
          static_cast<std::int32_t>(cells_.size()) + 1;
      cells_.push_back({cell.x, cell.y, cell.z});
    }
  }

  /// Each cell that is not covered yet gets the best of the boxes that grow from it along the axes
  /// in different order.
  std::vector<Box> run() {
    for (const std::size_t seed : seeds()) {
      if (covers_[seed] > 0) continue;
      boxes_.push_back(bestFrom(cells_[seed]));
      forEachCell(boxes_.back(), [this](std::int32_t i) {
        ++covers_[static_cast<std::size_t>(i)];
        return true;
      });
    }
    removeSuperfluous();
    return std::move(boxes_);
  }

 private:
  /// Number of the cell, -1 if it is not one of them.
  std::int32_t at(const Coordinates& cell) const {
    for (const std::int32_t v : cell)
      if (v < -detail::kCellLimit || v >= detail::kCellLimit) return -1;
    const std::int32_t* number = numbers_.find(detail::packCell(cell[0], cell[1], cell[2]));
    return number == nullptr ? -1 : *number - 1;
  }

  /// Visits the numbers of the box's cells until visit returns false.
  template <typename Visit>
  bool forEachCell(const Box& box, const Visit& visit) const {
    Coordinates cell;
    for (cell[2] = box.low[2]; cell[2] < box.low[2] + box.size[2]; ++cell[2])
      for (cell[1] = box.low[1]; cell[1] < box.low[1] + box.size[1]; ++cell[1])
        for (cell[0] = box.low[0]; cell[0] < box.low[0] + box.size[0]; ++cell[0])
          if (!visit(at(cell))) return false;
    return true;
  }

  /// Cells with the fewest neighbours first: they leave the least choice.
  std::vector<std::size_t> seeds() const {
    std::vector<std::tuple<int, Coordinates, std::size_t>> ranked;
    ranked.reserve(cells_.size());
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      int neighbours = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const int step : {-1, 1}) {
          Coordinates other = cells_[i];
          other[axis] += step;
          neighbours += at(other) >= 0 ? 1 : 0;
        }
      }
      ranked.emplace_back(neighbours, cells_[i], i);
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::size_t> order;
    order.reserve(ranked.size());
    for (const auto& entry : ranked) order.push_back(std::get<2>(entry));
    return order;
  }

  Box bestFrom(const Coordinates& seed) const {
    Box best{seed, {1, 1, 1}};
    std::int64_t most = 0;
    for (const AxisOrder& order : kAxisOrders) {
      Box box{seed, {1, 1, 1}};
      for (const std::size_t axis : order) {
        while (isFull(box, axis, box.low[axis] + box.size[axis])) ++box.size[axis];
        while (isFull(box, axis, box.low[axis] - 1)) {
          --box.low[axis];
          ++box.size[axis];
        }
      }
      std::int64_t gain = 0;
      forEachCell(box, [&](std::int32_t i) {
        gain += covers_[static_cast<std::size_t>(i)] == 0 ? 1 : 0;
        return true;
      });
      if (gain > most) {
        most = gain;
        best = box;
      }
    }
    return best;
  }

  /// Could the box grow by the layer at that position?
  bool isFull(Box layer, std::size_t axis, std::int32_t position) const {
    layer.low[axis] = position;
    layer.size[axis] = 1;
    return forEachCell(layer, [](std::int32_t i) { return i >= 0; });
  }

  /// A box whose cells are all covered by others as well; small boxes are asked first.
  void removeSuperfluous() {
    std::vector<std::size_t> order(boxes_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [this](std::size_t l, std::size_t r) {
      return boxes_[l].cells() < boxes_[r].cells();
    });
    std::vector<char> keep(boxes_.size(), 1);
    for (const std::size_t i : order) {
      keep[i] = !forEachCell(boxes_[i], [this](std::int32_t cell) {
        return covers_[static_cast<std::size_t>(cell)] > 1;
      });
      if (keep[i]) continue;
      forEachCell(boxes_[i], [this](std::int32_t cell) {
        --covers_[static_cast<std::size_t>(cell)];
        return true;
      });
    }
    std::vector<Box> left;
    for (std::size_t i = 0; i < boxes_.size(); ++i)
      if (keep[i]) left.push_back(boxes_[i]);
    boxes_ = std::move(left);
  }

  std::vector<Coordinates> cells_;
  detail::CellTable<std::int32_t> numbers_;  ///< + 1
  std::vector<std::int32_t> covers_;         ///< number of boxes over each cell
  std::vector<Box> boxes_;
};

}  // namespace

std::vector<GridBox> greedyCover(const std::vector<GridCell>& cells) {
  for (const GridCell& cell : cells)
    for (const std::int32_t v : {cell.x, cell.y, cell.z})
      if (v < -detail::kCellLimit || v >= detail::kCellLimit)
        throw InputError("a cell is beyond the lattice");
  std::vector<GridCell> distinct = cells;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  std::vector<GridBox> boxes;
  for (const Box& box : BoxCover(distinct).run()) {
    boxes.push_back(
        {{box.low[0], box.low[1], box.low[2]}, {box.size[0], box.size[1], box.size[2]}});
  }
  return boxes;
}

}  // namespace evaluation
}  // namespace planar_mapping
