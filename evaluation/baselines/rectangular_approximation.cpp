// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/baselines/rectangular_approximation.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>

#include "planar_mapping/base/disjoint_parts.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/map/store/cell_key.h"

namespace planar_mapping::evaluation {
namespace {

constexpr std::size_t kHeaderBytes = 42;
constexpr std::size_t kBoxBytes = 20;

using AxisOrder = std::array<std::size_t, 3>;
constexpr std::array<AxisOrder, 6> kAxisOrders = {AxisOrder{0, 1, 2}, AxisOrder{1, 0, 2},
                                                  AxisOrder{2, 0, 1}, AxisOrder{0, 2, 1},
                                                  AxisOrder{1, 2, 0}, AxisOrder{2, 1, 0}};

std::vector<GridCell> distinct(std::vector<GridCell> cells) {
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

/// A box on its way to be fused.
struct Part : GridBox {
  std::uint32_t part;  ///< that hangs together across faces; boxes of two parts never fuse

  std::int64_t end(std::size_t axis) const { return std::int64_t{low[axis]} + size[axis]; }
};

/// Brings boxes that may form runs along the axis next to each other, in their order.
void sortIntoRuns(std::vector<Part>& boxes, std::size_t axis) {
  const std::size_t u = (axis + 1) % 3;
  const std::size_t v = (axis + 2) % 3;
  const auto key = [axis, u, v](const Part& b) {
    return std::make_tuple(b.low[u], b.low[v], b.size[u], b.size[v], b.low[axis]);
  };
  std::sort(boxes.begin(), boxes.end(),
            [&key](const Part& a, const Part& b) { return key(a) < key(b); });
}

/// Is \p b right behind \p a along the axis, and do they share a complete face?
bool follows(const Part& a, const Part& b, std::size_t axis) {
  const std::size_t u = (axis + 1) % 3;
  const std::size_t v = (axis + 2) % 3;
  return a.low[u] == b.low[u] && a.low[v] == b.low[v] && a.size[u] == b.size[u] &&
         a.size[v] == b.size[v] && a.end(axis) == b.low[axis];
}

/// Fuses all runs along one axis; false if there was none.
bool fuseRuns(std::vector<Part>& boxes, std::size_t axis) {
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

std::vector<Part> fuse(std::vector<Part> boxes, const AxisOrder& order) {
  for (bool fused = true; fused;) {
    fused = false;
    for (const std::size_t axis : order) fused = fuseRuns(boxes, axis) || fused;
  }
  return boxes;
}

/// Numbers the parts of single cells that hang together across faces. \return how many there are
std::uint32_t numberParts(std::vector<Part>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i].part = static_cast<std::uint32_t>(i);
  DisjointParts united(cells.size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sortIntoRuns(cells, axis);
    for (std::size_t i = 1; i < cells.size(); ++i)
      if (follows(cells[i - 1], cells[i], axis)) united.unite(cells[i].part, cells[i - 1].part);
  }
  std::uint32_t parts = 0;
  std::vector<std::uint32_t> number(cells.size());
  for (std::uint32_t i = 0; i < number.size(); ++i)
    if (united.of(i) == i) number[i] = parts++;
  for (Part& cell : cells) cell.part = number[united.of(cell.part)];
  return parts;
}

class BoxCover {
 public:
  /// \param cells  distinct, ascending
  explicit BoxCover(const std::vector<GridCell>& cells) : covers_(cells.size(), 0) {
    for (const GridCell& cell : cells) cells_[planar_mapping::detail::packKey(cell)] = cell;
  }

  /// Each cell that is not covered yet gets the best of the boxes that grow from it along the axes
  /// in different order.
  std::vector<GridBox> run() {
    for (const std::size_t seed : seeds()) {
      if (covers_[seed] > 0) continue;
      boxes_.push_back(bestFrom(cells_.value(seed)));
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
  std::int32_t at(const GridCell& cell) const {
    for (const std::int32_t v : {cell.x, cell.y, cell.z})
      if (v < -planar_mapping::detail::kLatticeLimit || v >= planar_mapping::detail::kLatticeLimit)
        return -1;
    const std::size_t number = cells_.indexOf(planar_mapping::detail::packKey(cell));
    return number == cells_.kNone ? -1 : static_cast<std::int32_t>(number);
  }

  /// Visits the numbers of the box's cells until visit returns false.
  template <typename Visit>
  bool forEachCell(const GridBox& box, const Visit& visit) const {
    GridCell cell;
    for (cell.z = box.low.z; cell.z < box.low.z + box.size.z; ++cell.z)
      for (cell.y = box.low.y; cell.y < box.low.y + box.size.y; ++cell.y)
        for (cell.x = box.low.x; cell.x < box.low.x + box.size.x; ++cell.x)
          if (!visit(at(cell))) return false;
    return true;
  }

  /// Cells with the fewest neighbours first: they leave the least choice.
  std::vector<std::size_t> seeds() const {
    // By neighbours, x, y, z.
    std::vector<std::tuple<int, std::int32_t, std::int32_t, std::int32_t, std::size_t>> ranked;
    ranked.reserve(cells_.size());
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      int neighbours = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const int step : {-1, 1}) {
          GridCell other = cells_.value(i);
          other[axis] += step;
          neighbours += at(other) >= 0 ? 1 : 0;
        }
      }
      const GridCell& cell = cells_.value(i);
      ranked.emplace_back(neighbours, cell.x, cell.y, cell.z, i);
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::size_t> order;
    order.reserve(ranked.size());
    for (const auto& entry : ranked) order.push_back(std::get<4>(entry));
    return order;
  }

  GridBox bestFrom(const GridCell& seed) const {
    GridBox best{seed};
    std::int64_t most = 0;
    for (const AxisOrder& order : kAxisOrders) {
      GridBox box{seed};
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
  bool isFull(GridBox layer, std::size_t axis, std::int32_t position) const {
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
    std::vector<GridBox> left;
    for (std::size_t i = 0; i < boxes_.size(); ++i)
      if (keep[i]) left.push_back(boxes_[i]);
    boxes_ = std::move(left);
  }

  planar_mapping::detail::KeyMap<GridCell> cells_;
  std::vector<std::int32_t> covers_;  ///< number of boxes over each cell
  std::vector<GridBox> boxes_;
};

}  // namespace

std::vector<GridBox> fuseCells(const std::vector<GridCell>& cells) {
  std::vector<Part> single;
  for (const GridCell& cell : distinct(cells)) single.push_back({{cell, {1, 1, 1}}, 0});
  const std::uint32_t parts = numberParts(single);

  std::array<std::vector<Part>, kAxisOrders.size()> results;
  std::vector<std::size_t> fewest(parts, single.size() + 1);
  std::vector<std::size_t> best_order(parts, 0);
  for (std::size_t order = 0; order < kAxisOrders.size(); ++order) {
    results[order] = fuse(single, kAxisOrders[order]);
    std::vector<std::size_t> count(parts, 0);
    for (const Part& box : results[order]) ++count[box.part];
    for (std::uint32_t part = 0; part < parts; ++part) {
      if (count[part] >= fewest[part]) continue;
      fewest[part] = count[part];
      best_order[part] = order;
    }
  }
  std::vector<GridBox> boxes;
  for (std::size_t order = 0; order < kAxisOrders.size(); ++order) {
    for (const Part& box : results[order]) {
      if (best_order[box.part] != order) continue;
      boxes.push_back(box);
    }
  }
  std::sort(boxes.begin(), boxes.end(),
            [](const GridBox& a, const GridBox& b) { return a.low < b.low; });
  return boxes;
}

std::vector<GridBox> greedyCover(const std::vector<GridCell>& cells) {
  for (const GridCell& cell : cells)
    for (const std::int32_t v : {cell.x, cell.y, cell.z})
      if (v < -planar_mapping::detail::kLatticeLimit || v >= planar_mapping::detail::kLatticeLimit)
        throw InputError("a cell is beyond the lattice");
  return BoxCover(distinct(cells)).run();
}

std::vector<GridBox> boxesByDensity(const std::vector<GridCell>& cells, double density) {
  requireInRange("density", density, 0.0, 1.0);
  requirePositive("density", density);
  std::vector<GridCell> all = distinct(cells);
  std::vector<GridBox> boxes;
  std::vector<std::pair<std::size_t, std::size_t>> parts;  // of all
  if (!all.empty()) parts.emplace_back(0, all.size());
  while (!parts.empty()) {
    const auto [first, last] = parts.back();
    parts.pop_back();
    GridBox box{all[first]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::int32_t high = box.low[axis];
      for (std::size_t i = first; i < last; ++i) {
        box.low[axis] = std::min(box.low[axis], all[i][axis]);
        high = std::max(high, all[i][axis]);
      }
      box.size[axis] = high - box.low[axis] + 1;
    }
    if (static_cast<double>(last - first) >= density * static_cast<double>(box.cells())) {
      boxes.push_back(box);
      continue;
    }
    std::size_t longest = 0;
    for (const std::size_t axis : {std::size_t{1}, std::size_t{2}})
      if (box.size[axis] > box.size[longest]) longest = axis;
    const std::int32_t middle = box.low[longest] + box.size[longest] / 2;
    const auto begin = all.begin();
    const auto half = std::stable_partition(
        begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(last),
        [&](const GridCell& cell) { return cell[longest] < middle; });
    const auto split = static_cast<std::size_t>(half - begin);
    parts.emplace_back(split, last);
    parts.emplace_back(first, split);
  }
  return boxes;
}

RectangularApproximation::RectangularApproximation(double s, const std::vector<GridCell>& cells)
    : side_(s) {
  requirePositive("s", s, "m");
  std::vector<GridBox> fused = fuseCells(cells);
  std::vector<GridBox> cover = greedyCover(cells);
  boxes_ = fused.size() < cover.size() ? std::move(fused) : std::move(cover);
}

std::vector<Cuboid> RectangularApproximation::cuboids() const {
  return cuboidsOf(boxes_, side_);
}

std::size_t RectangularApproximation::memoryBytes() const {
  return boxes_.size() * kBoxBytes;
}

std::size_t RectangularApproximation::fileBytes() const {
  if (boxes_.empty()) return kHeaderBytes;
  GridCell low = boxes_.front().low;
  GridCell high = low;  // of the low corners
  GridCell longest;
  for (const GridBox& box : boxes_) {
    low = {std::min(low.x, box.low.x), std::min(low.y, box.low.y), std::min(low.z, box.low.z)};
    high = {std::max(high.x, box.low.x), std::max(high.y, box.low.y), std::max(high.z, box.low.z)};
    longest = {std::max(longest.x, box.size.x), std::max(longest.y, box.size.y),
               std::max(longest.z, box.size.z)};
  }
  const double corners = (high.x - low.x + 1.0) * (high.y - low.y + 1.0) * (high.z - low.z + 1.0);
  const double sizes = static_cast<double>(longest.x) * longest.y * longest.z;
  return kHeaderBytes + planar_mapping::detail::bytesOfBits(
                            boxes_.size(), planar_mapping::detail::bitsFor(corners) +
                                               planar_mapping::detail::bitsFor(sizes));
}

}  // namespace planar_mapping::evaluation
