// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/cover/cell_covers.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "cuboids/cover/cell_parts.h"

namespace planar_mapping::detail {
namespace {

bool follows(const LatticeBox& a, const LatticeBox& b, std::size_t axis) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (k != axis && (a.low[k] != b.low[k] || a.high[k] != b.high[k])) return false;
  }
  return a.high[axis] == b.low[axis];
}

/// Fuses all runs along one axis. \return whether there was any
bool fuseRuns(BoxList& boxes, std::size_t axis) {
  const std::size_t u = (axis + 1) % 3;
  const std::size_t v = (axis + 2) % 3;
  const auto key = [axis, u, v](const LatticeBox& b) {
    return std::tie(b.low[u], b.low[v], b.high[u], b.high[v], b.low[axis]);
  };
  std::sort(boxes.begin(), boxes.end(),
            [&key](const LatticeBox& a, const LatticeBox& b) { return key(a) < key(b); });
  std::size_t kept = 0;
  for (const LatticeBox& box : boxes) {
    if (kept > 0 && follows(boxes[kept - 1], box, axis)) {
      boxes[kept - 1].high[axis] = box.high[axis];
    } else {
      boxes[kept++] = box;
    }
  }
  const bool fused = kept < boxes.size();
  boxes.resize(kept);
  return fused;
}

BoxList fused(BoxList boxes, const AxisOrder& order) {
  for (bool any = true; any;) {
    any = false;
    for (const std::size_t axis : order) any |= fuseRuns(boxes, axis);
  }
  return boxes;
}

/// Each cell that is left gets the box with most new cells of those that grow from it; boxes that
/// others make superfluous are taken away.
class GreedyCover {
 public:
  explicit GreedyCover(const BitGrid& cells)
      : cells_(cells), left_(cells), numbers_(cells), times_(numbers_.count(), 0) {}

  BoxList run() {
    for (const LatticeCell& seed : seeds()) {
      if (!left_.holds(seed)) continue;
      boxes_.push_back(bestFrom(seed));
      left_.clear(boxes_.back());
      numbers_.forEach(boxes_.back(), [this](std::size_t number) { ++times_[number]; });
    }
    removeSuperfluous();
    return std::move(boxes_);
  }

 private:
  /// Cells with the fewest neighbours first: they leave the least choice.
  std::vector<LatticeCell> seeds() const {
    std::vector<std::pair<int, LatticeCell>> ranked;
    for (const LatticeCell& cell : listCells(cells_)) {
      int neighbours = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const std::int32_t step : {-1, 1}) {
          LatticeCell other = cell;
          other[axis] += step;
          neighbours += cells_.holds(other) ? 1 : 0;
        }
      }
      ranked.emplace_back(neighbours, cell);
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<LatticeCell> order;
    for (const auto& entry : ranked) order.push_back(entry.second);
    return order;
  }

  LatticeBox bestFrom(const LatticeCell& seed) const {
    LatticeBox best = boxOf(seed);
    std::int64_t most = 0;
    for (const AxisOrder& order : kAxisOrders) {
      LatticeBox box = boxOf(seed);
      for (const std::size_t axis : order) {
        cells_.extendUp(box, axis);
        cells_.extendDown(box, axis);
      }
      const std::int64_t gain = left_.count(box);
      if (gain <= most) continue;
      most = gain;
      best = box;
    }
    return best;
  }

  /// Small boxes are asked first.
  void removeSuperfluous() {
    std::stable_sort(boxes_.begin(), boxes_.end(), [](const LatticeBox& l, const LatticeBox& r) {
      return volume(l) < volume(r);
    });
    const auto isSuperfluous = [this](const LatticeBox& box) {
      bool needed = false;
      numbers_.forEach(box, [&](std::size_t number) { needed |= times_[number] == 1; });
      if (needed) return false;
      numbers_.forEach(box, [this](std::size_t number) { --times_[number]; });
      return true;
    };
    boxes_.erase(std::remove_if(boxes_.begin(), boxes_.end(), isSuperfluous), boxes_.end());
  }

  const BitGrid& cells_;
  BitGrid left_;
  const CellNumbers numbers_;
  std::vector<std::int32_t> times_;  ///< boxes over each cell
  BoxList boxes_;
};

/// The part of each cell, by their numbers.
CellParts partsOf(const BitGrid& cells, const CellNumbers& numbers) {
  CellParts parts(numbers.count());
  const auto numberOf = [&](const LatticeCell& c) {
    return static_cast<std::uint32_t>(numbers.at(c[0], c[1], c[2]));
  };
  for (const LatticeCell& cell : listCells(cells)) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      LatticeCell next = cell;
      ++next[axis];
      if (cells.holds(next)) parts.unite(numberOf(cell), numberOf(next));
    }
  }
  return parts;
}

}  // namespace

BoxList coverOfCells(const BitGrid& cells) {
  BoxList single;
  for (const LatticeCell& cell : listCells(cells)) single.push_back(boxOf(cell));
  std::array<BoxList, 3> runs{single, single, single};
  for (std::size_t axis = 0; axis < 3; ++axis) fuseRuns(runs[axis], axis);
  std::vector<BoxList> covers{GreedyCover(cells).run()};
  for (const AxisOrder& order : kAxisOrders) covers.push_back(fused(runs[order[0]], order));

  const CellNumbers numbers(cells);
  CellParts parts = partsOf(cells, numbers);
  const auto partOf = [&](const LatticeBox& box) {
    return parts.of(static_cast<std::uint32_t>(numbers.at(box.low[0], box.low[1], box.low[2])));
  };
  std::vector<std::size_t> best(numbers.count(), 0);
  std::vector<std::size_t> fewest(numbers.count(), numbers.count() + 1);
  for (std::size_t c = 0; c < covers.size(); ++c) {
    std::vector<std::size_t> count(numbers.count(), 0);
    for (const LatticeBox& box : covers[c]) ++count[partOf(box)];
    for (std::size_t part = 0; part < count.size(); ++part) {
      if (count[part] == 0 || count[part] >= fewest[part]) continue;
      fewest[part] = count[part];
      best[part] = c;
    }
  }
  BoxList result;
  for (std::size_t c = 0; c < covers.size(); ++c) {
    for (const LatticeBox& box : covers[c]) {
      if (best[partOf(box)] == c) result.push_back(box);
    }
  }
  return result;
}

}  // namespace planar_mapping::detail
