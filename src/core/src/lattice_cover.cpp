// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "lattice_cover.h"

#include <algorithm>
#include <numeric>
#include <queue>
#include <tuple>

namespace planar_mapping::detail {

namespace {

using Axes = std::array<std::size_t, 3>;
using Cell = LatticeCell;

/// A box or set of more cells is not dissolved into its neighbours: they hardly ever have room.
constexpr std::size_t kMostMoved = 4096;

constexpr std::array<Axes, 6> kOrders = {Axes{0, 1, 2}, Axes{0, 2, 1}, Axes{1, 0, 2},
                                         Axes{1, 2, 0}, Axes{2, 0, 1}, Axes{2, 1, 0}};

LatticeBox grown(const LatticeBox& box, const std::array<std::int32_t, 3>& by) {
  LatticeBox b = box;
  for (std::size_t k = 0; k < 3; ++k) {
    b.low[k] -= by[k];
    b.high[k] += by[k];
  }
  return b;
}

LatticeBox boxOf(const Cell& c) {
  return {c, {c[0] + 1, c[1] + 1, c[2] + 1}};
}

void include(LatticeBox& hull, const LatticeBox& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    hull.low[k] = std::min(hull.low[k], other.low[k]);
    hull.high[k] = std::max(hull.high[k], other.high[k]);
  }
}

class LatticeCover {
 public:
  LatticeCover(const BitGrid& required, const BitGrid& allowed, const CoverRules& rules,
               const std::vector<CellSet>& sets)
      : required_(required), allowed_(allowed), rules_(rules), sets_(sets), numbers_(required) {
    cells_.reserve(numbers_.count());
    required.forEach(required.window(), [&](std::int32_t x, std::int32_t y, std::int32_t z) {
      cells_.push_back({x, y, z});
    });
  }

  LatticeCoverage run() {
    const std::vector<LatticeBox> boxes = candidates();
    search(boxes, sets_.size());
    if (!sets_.empty()) {
      std::vector<Chosen> with_sets = std::move(chosen_);
      const bool alone = search(boxes, 0);
      if (!alone || with_sets.size() <= chosen_.size()) chosen_ = std::move(with_sets);
    }
    return drawnBack();
  }

 private:
  struct Chosen {
    LatticeBox need;                     ///< hull of its members
    std::vector<std::uint32_t> members;  ///< numbers of the cells this box or set answers for
    LatticeBox box;
    const CellSet* set = nullptr;  ///< null for a box
  };

  /// A cover of boxes and of the first \p sets sets. \return whether it is one of all cells
  bool search(const std::vector<LatticeBox>& boxes, std::size_t sets) {
    chosen_.clear();
    const bool is_whole = choose(boxes, sets);
    assign();
    for (bool changed = true; changed;) changed = dissolveAll();
    return is_whole;
  }

  void grow(LatticeBox& box, std::size_t axis) const {
    allowed_.extendUp(box, axis);
    allowed_.extendDown(box, axis);
  }

  /// The boxes that grow from the required cells along the axes in each of the six orders.
  std::vector<LatticeBox> candidates() const {
    std::vector<LatticeBox> found;
    // Cells that would grow to a box that is there already.
    BitGrid done(required_.size()[0], required_.size()[1], required_.size()[2]);
    for (const Axes& order : kOrders) {
      if (isRepeated(order)) continue;
      for (const Cell& cell : cells_) {
        if (done.at(cell[0], cell[1], cell[2])) continue;
        LatticeBox box = boxOf(cell);
        grow(box, order[0]);
        const LatticeBox run = box;
        grow(box, order[1]);
        markSameRuns(run, box, order, done);
        grow(box, order[2]);
        if (isLargeEnough(box)) found.push_back(box);
      }
      for (const Cell& cell : cells_) done.clearWordOf(cell);
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  /// Nothing grows along an axis of one cell: when it is its turn makes no difference, so that it
  /// may as well be the last.
  bool isRepeated(const Axes& order) const {
    const auto isFlat = [&](std::size_t i) { return required_.size()[order[i]] == 1; };
    return (isFlat(0) && !isFlat(1)) || (isFlat(1) && !isFlat(2)) || (isFlat(0) && !isFlat(2));
  }

  /// Runs beside \p run within \p sheet that end where it ends grow to the same sheet.
  void markSameRuns(const LatticeBox& run, const LatticeBox& sheet, const Axes& order,
                    BitGrid& done) const {
    LatticeBox same = run;
    for (std::int32_t i = sheet.low[order[1]]; i < sheet.high[order[1]]; ++i) {
      same.low[order[1]] = i;
      same.high[order[1]] = i + 1;
      Cell before = same.low;
      Cell after = same.low;
      --before[order[0]];
      after[order[0]] = same.high[order[0]];
      if (!allowed_.holds(before) && !allowed_.holds(after)) done.fill(same);
    }
  }

  bool isLargeEnough(const LatticeBox& box) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (box.size(k) < rules_.smallest[k]) return false;
    }
    return true;
  }

  LatticeBox reach(const LatticeBox& box) const { return grown(box, rules_.tolerance); }

  /// Cells of the grid that candidate \p i stands for: a set, or the box after that many.
  std::int64_t gainOf(std::size_t i, const std::vector<LatticeBox>& boxes, std::size_t sets,
                      const BitGrid& left) const {
    if (i >= sets) return left.count(reach(boxes[i - sets]));
    return std::count_if(sets_[i].begin(), sets_[i].end(),
                         [&](const Cell& c) { return left.at(c[0], c[1], c[2]); });
  }

  bool choose(const std::vector<LatticeBox>& boxes, std::size_t sets) {
    BitGrid left = required_;
    std::int64_t open = left.count();
    // By gain, then by number: a gain only ever falls, so that an old one is a bound.
    std::priority_queue<std::pair<std::int64_t, std::int64_t>> queue;
    for (std::size_t i = 0; i < sets + boxes.size(); ++i) {
      queue.emplace(gainOf(i, boxes, sets, left), -static_cast<std::int64_t>(i));
    }
    while (open > 0 && !queue.empty()) {
      const auto [bound, number] = queue.top();
      queue.pop();
      const auto i = static_cast<std::size_t>(-number);
      const std::int64_t gain = gainOf(i, boxes, sets, left);
      if (gain == 0) continue;
      if (gain < bound && !queue.empty() && queue.top() > std::make_pair(gain, number)) {
        queue.emplace(gain, number);
        continue;
      }
      open -= gain;
      if (i < sets) {
        for (const Cell& c : sets_[i]) left.clear(boxOf(c));
        chosen_.push_back({{}, {}, {}, &sets_[i]});
        continue;
      }
      const LatticeBox& box = boxes[i - sets];
      left.clear(reach(box));
      chosen_.push_back({box, {}, box});
    }
    return open == 0;
  }

  /// Each cell to the first box or set that reaches it: the one with the most cells.
  void assign() {
    std::vector<char> taken(numbers_.count(), 0);
    for (Chosen& chosen : chosen_) {
      const auto take = [&](std::size_t number) {
        if (taken[number] == 0) chosen.members.push_back(static_cast<std::uint32_t>(number));
        taken[number] = 1;
      };
      if (chosen.set != nullptr) {
        for (const Cell& c : *chosen.set) take(numbers_.at(c[0], c[1], c[2]));
      } else {
        numbers_.forEach(reach(chosen.box), take);
      }
      chosen.need = hullOf(chosen.members);
    }
    ownAgain();
  }

  void ownAgain() {
    owner_.assign(numbers_.count(), 0);
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      for (const std::uint32_t number : chosen_[i].members) owner_[number] = i;
    }
    asked_.assign(chosen_.size(), 0);
  }

  LatticeBox hullOf(const std::vector<std::uint32_t>& members) const {
    LatticeBox hull = boxOf(cells_[members.front()]);
    for (const std::uint32_t number : members) include(hull, boxOf(cells_[number]));
    return hull;
  }

  /// The least boxes of allowed cells that reach all of \p need, until visit returns false.
  template <typename Visit>
  void forEachFit(const LatticeBox& need, Visit&& visit) const {
    Cell first{}, last{}, size{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t t = rules_.tolerance[k];
      size[k] = std::max(need.size(k) - 2 * t, rules_.smallest[k]);
      first[k] = need.high[k] - t - size[k];
      last[k] = need.low[k] + t;
    }
    LatticeBox box;
    for (std::int32_t z = first[2]; z <= last[2]; ++z) {
      for (std::int32_t y = first[1]; y <= last[1]; ++y) {
        for (std::int32_t x = first[0]; x <= last[0]; ++x) {
          box.low = {x, y, z};
          for (std::size_t k = 0; k < 3; ++k) box.high[k] = box.low[k] + size[k];
          if (allowed_.all(box) && !visit(box)) return;
        }
      }
    }
  }

  bool fits(const LatticeBox& need) const {
    bool found = false;
    forEachFit(need, [&](const LatticeBox&) {
      found = true;
      return false;
    });
    return found;
  }

  /// Boxes with few members are dissolved first. \return whether any was
  bool dissolveAll() {
    std::vector<std::size_t> order(chosen_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t l, std::size_t r) {
      return std::make_pair(chosen_[l].members.size(), l) <
             std::make_pair(chosen_[r].members.size(), r);
    });
    bool any = false;
    for (const std::size_t i : order) any |= dissolve(i);
    chosen_.erase(std::remove_if(chosen_.begin(), chosen_.end(),
                                 [](const Chosen& c) { return c.members.empty(); }),
                  chosen_.end());
    ownAgain();
    return any;
  }

  /// Gives the members of a box to others that may grow for them; all of them or none.
  bool dissolve(std::size_t i) {
    const std::vector<std::uint32_t>& members = chosen_[i].members;
    if (members.empty() || members.size() > kMostMoved) return false;
    neighbours_.clear();
    numbers_.forEach(grown(chosen_[i].need, {2, 2, 2}), [&](std::size_t number) {
      const std::size_t j = owner_[number];
      if (j == i || asked_[j] == i + 1) return;
      asked_[j] = i + 1;
      neighbours_.push_back(j);
    });
    std::sort(neighbours_.begin(), neighbours_.end());
    need_.clear();
    for (const std::size_t j : neighbours_) need_.push_back(chosen_[j].need);
    to_.clear();
    for (const std::uint32_t number : members) {
      const Cell& member = cells_[number];
      const std::size_t to = bestFor(member);
      if (to == need_.size()) {
        for (const std::size_t j : neighbours_) asked_[j] = 0;
        return false;
      }
      to_.push_back(to);
      include(need_[to], boxOf(member));
    }
    for (std::size_t m = 0; m < members.size(); ++m) {
      const std::size_t j = neighbours_[to_[m]];
      chosen_[j].members.push_back(members[m]);
      owner_[members[m]] = j;
    }
    for (std::size_t k = 0; k < need_.size(); ++k) {
      chosen_[neighbours_[k]].need = need_[k];
      asked_[neighbours_[k]] = 0;
    }
    chosen_[i].members.clear();
    return true;
  }

  /// Of the neighbours the one that need not grow for the cell, else the one that grows least; the
  /// number of neighbours if none may.
  std::size_t bestFor(const Cell& member) const {
    std::size_t best = need_.size();
    std::int64_t least = 0;
    for (std::size_t k = 0; k < need_.size(); ++k) {
      LatticeBox hull = need_[k];
      include(hull, boxOf(member));
      const CellSet* set = chosen_[neighbours_[k]].set;
      const std::int64_t growth = set != nullptr ? 0 : volume(hull) - volume(need_[k]);
      if (best < need_.size() && growth >= least) continue;
      if (set != nullptr && !std::binary_search(set->begin(), set->end(), member)) continue;
      if (growth > 0 && !fits(hull)) continue;
      best = k;
      least = growth;
      if (growth == 0) break;
    }
    return best;
  }

  static std::int64_t volume(const LatticeBox& box) {
    return static_cast<std::int64_t>(box.size(0)) * box.size(1) * box.size(2);
  }

  /// Is an eighth of the layer beyond the face required? Then the box may as well hold it: the
  /// surface in it may lie at its far side, beyond the tolerance.
  bool isWorthHolding(const LatticeBox& box, std::size_t axis, bool up) const {
    LatticeBox layer = box;
    layer.low[axis] = up ? box.high[axis] : box.low[axis] - 1;
    layer.high[axis] = layer.low[axis] + 1;
    return 8 * required_.count(layer) >= volume(layer) && allowed_.all(layer);
  }

  /// Widens the box towards \p need.
  LatticeBox widened(LatticeBox box, const LatticeBox& need) const {
    for (std::size_t k = 0; k < 3; ++k) {
      while (box.high[k] < need.high[k] && isWorthHolding(box, k, true)) ++box.high[k];
      while (box.low[k] > need.low[k] && isWorthHolding(box, k, false)) --box.low[k];
    }
    return box;
  }

  /// Of the least boxes that do, the one that holds most of what it stands for; on whole cells if
  /// there is a choice.
  LatticeCoverage drawnBack() const {
    LatticeCoverage coverage;
    for (const Chosen& c : chosen_) {
      if (c.set != nullptr) {
        coverage.sets.push_back(static_cast<std::size_t>(c.set - sets_.data()));
        continue;
      }
      CoverBox result;
      std::int64_t most = -1;
      forEachFit(c.need, [&](const LatticeBox& least) {
        const LatticeBox box = widened(least, c.need);
        std::int64_t score = 8 * required_.count(box);
        for (std::size_t k = 0; k < 3; ++k) score += (box.low[k] & 1) == 0;
        if (score > most) {
          most = score;
          result.box = box;
        }
        return true;
      });
      result.members.reserve(c.members.size());
      for (const std::uint32_t number : c.members) result.members.push_back(cells_[number]);
      coverage.boxes.push_back(std::move(result));
    }
    std::sort(coverage.sets.begin(), coverage.sets.end());
    return coverage;
  }

  const BitGrid& required_;
  const BitGrid& allowed_;
  const CoverRules rules_;
  const std::vector<CellSet>& sets_;
  const CellNumbers numbers_;
  std::vector<Cell> cells_;  ///< that are required, by their number
  std::vector<Chosen> chosen_;
  std::vector<std::size_t> owner_;  ///< of each required cell, by its number
  std::vector<std::size_t> asked_;  ///< by box: who asks it just now, + 1
  // Of the box that is being dissolved:
  std::vector<std::size_t> neighbours_;
  std::vector<LatticeBox> need_;  ///< of the neighbours, with what they are to take over
  std::vector<std::size_t> to_;   ///< neighbour of each member
};

}  // namespace

LatticeCoverage coverWithin(const BitGrid& required, const BitGrid& allowed,
                            const CoverRules& rules, const std::vector<CellSet>& sets) {
  return LatticeCover(required, allowed, rules, sets).run();
}

}  // namespace planar_mapping::detail
