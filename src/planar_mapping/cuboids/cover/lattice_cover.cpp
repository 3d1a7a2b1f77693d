// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/cover/lattice_cover.h"

#include <algorithm>
#include <numeric>
#include <queue>
#include <utility>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/cuboids/cover/box_search.h"

namespace planar_mapping::detail {

namespace {

using Cell = LatticeCell;

/// A box or set of more cells is not dissolved into its neighbours: they hardly ever have room.
constexpr std::size_t kMaxMoved = 4096;
/// Boxes alone that are so many more than the cover with sets are not searched for fewer.
constexpr std::size_t kMaxMoreBoxes = 2;
/// Neighbours of a box have cells this near.
constexpr std::array<std::int32_t, 3> kNear{2, 2, 2};

class LatticeCover {
 public:
  LatticeCover(const BitGrid& required, const BitGrid& allowed, const CoverRules& rules,
               const std::vector<CellSet>& sets)
      : required_(required),
        allowed_(allowed),
        rules_(rules),
        sets_(sets),
        numbers_(required),
        cells_(listCells(required)),
        boxes_(largestBoxes(required, allowed, rules)) {
    for (const LatticeBox& box : boxes_) box_gain_.push_back(required.count(reach(box)));
  }

  LatticeCoverage run(CoverEffort effort) {
    const bool is_full = effort == CoverEffort::Full;
    search(sets_.size());
    if (is_full) searchBoxes();
    if (!sets_.empty()) {
      std::vector<Chosen> with_sets = std::move(chosen_);
      const bool alone = search(0);
      if (is_full && chosen_.size() <= with_sets.size() + kMaxMoreBoxes) searchBoxes();
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
    bool is_settled = false;       ///< cannot be dissolved as long as nothing near it changes
  };

  /// A cover of boxes and of the first \p sets sets. \return whether it is one of all cells
  bool search(std::size_t sets) {
    chosen_.clear();
    const bool is_whole = choose(sets);
    assign();
    improve();
    return is_whole;
  }

  void improve() {
    for (bool changed = true; changed;) changed = dissolveAll();
  }

  void dropEmpty() {
    eraseIf(chosen_, [](const Chosen& c) { return c.members.empty(); });
  }

  /// Fewer boxes for what no set of the cover holds, if they are found.
  void searchBoxes() {
    constexpr std::size_t kNoSet = ~std::size_t{0};
    std::vector<std::size_t> set_of(cells_.size(), kNoSet);
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      if (chosen_[i].set == nullptr) continue;
      for (const std::uint32_t number : *chosen_[i].set) set_of[number] = i;
    }
    BoxList needs;
    CellSet alone;
    for (const Chosen& c : chosen_) {
      if (c.set != nullptr) continue;
      needs.push_back(c.need);
      for (const std::uint32_t number : c.members) {
        if (set_of[number] == kNoSet) alone.push_back(number);
      }
    }
    std::sort(alone.begin(), alone.end());
    const auto found = fewerBoxes({allowed_, rules_, numbers_, cells_, boxes_}, alone, needs);
    if (!found) return;
    for (Chosen& c : chosen_) {
      c.is_settled = false;
      if (c.set != nullptr) continue;
      for (const std::uint32_t number : c.members) {
        if (set_of[number] != kNoSet) chosen_[set_of[number]].members.push_back(number);
      }
      c.members.clear();
    }
    dropEmpty();
    for (const CellSet& members : *found) {
      chosen_.emplace_back();
      chosen_.back().need = hullOf(members);
      chosen_.back().members = members;
    }
    ownAgain();
    improve();
  }

  LatticeBox reach(const LatticeBox& box) const { return grown(box, rules_.tolerance); }

  /// Cells left that candidate \p i stands for: a set, or the box after that many.
  std::int64_t gainOf(std::size_t i, std::size_t sets, const BitGrid& left) const {
    if (i >= sets) return left.count(reach(boxes_[i - sets]));
    return std::count_if(sets_[i].begin(), sets_[i].end(), [&](std::uint32_t number) {
      const Cell& c = cells_[number];
      return left.at(c[0], c[1], c[2]);
    });
  }

  bool choose(std::size_t sets) {
    // By gain, then by number: a gain only ever falls, so that an old one is a bound.
    std::vector<std::pair<std::int64_t, std::int64_t>> candidates;
    for (std::size_t i = 0; i < sets + boxes_.size(); ++i) {
      const std::int64_t gain =
          i < sets ? static_cast<std::int64_t>(sets_[i].size()) : box_gain_[i - sets];
      candidates.emplace_back(gain, -static_cast<std::int64_t>(i));
    }
    std::priority_queue<std::pair<std::int64_t, std::int64_t>> queue({}, std::move(candidates));
    BitGrid left = required_;
    auto open = static_cast<std::int64_t>(cells_.size());
    while (open > 0 && !queue.empty()) {
      const auto [bound, number] = queue.top();
      queue.pop();
      const auto i = static_cast<std::size_t>(-number);
      const std::int64_t gain = gainOf(i, sets, left);
      if (gain == 0) continue;
      if (gain < bound && !queue.empty() && queue.top() > std::make_pair(gain, number)) {
        queue.emplace(gain, number);
        continue;
      }
      open -= gain;
      chosen_.emplace_back();
      if (i < sets) {
        for (const std::uint32_t n : sets_[i]) left.reset(cells_[n][0], cells_[n][1], cells_[n][2]);
        chosen_.back().set = &sets_[i];
        continue;
      }
      chosen_.back().box = boxes_[i - sets];
      left.clear(reach(boxes_[i - sets]));
    }
    // Where no box of the least size has room, a cell is a box.
    left.forEach(left.window(), [&](std::int32_t x, std::int32_t y, std::int32_t z) {
      chosen_.emplace_back();
      chosen_.back().box = boxOf({x, y, z});
    });
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
        for (const std::uint32_t number : *chosen.set) take(number);
      } else {
        numbers_.forEach(reach(chosen.box), take);
      }
      if (!chosen.members.empty()) chosen.need = hullOf(chosen.members);
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

  /// Boxes with few members are dissolved first. \return whether any was
  bool dissolveAll() {
    std::vector<std::size_t> order(chosen_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t l, std::size_t r) {
      return std::make_pair(chosen_[l].members.size(), l) <
             std::make_pair(chosen_[r].members.size(), r);
    });
    bool any = false;
    for (const std::size_t i : order) {
      if (!chosen_[i].is_settled) any |= dissolve(i);
    }
    dropEmpty();
    ownAgain();
    return any;
  }

  /// Gives the members of a box to others that may grow for them; all of them or none.
  bool dissolve(std::size_t i) {
    const std::vector<std::uint32_t>& members = chosen_[i].members;
    if (members.empty() || members.size() > kMaxMoved) return false;
    chosen_[i].is_settled = true;
    neighbours_.clear();
    numbers_.forEach(grown(chosen_[i].need, kNear), [&](std::size_t number) {
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
      const std::size_t to = bestFor(number);
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
    for (Chosen& c : chosen_) {
      const auto isNear = [&](const LatticeBox& need) { return meet(grown(c.need, kNear), need); };
      c.is_settled &= std::none_of(need_.begin(), need_.end(), isNear);
    }
    return true;
  }

  /// Of the neighbours the one that need not grow for the cell, else the one that grows least; the
  /// number of neighbours if none may.
  std::size_t bestFor(std::uint32_t number) const {
    const LatticeBox member = boxOf(cells_[number]);
    std::size_t best = need_.size();
    std::int64_t least = 0;
    for (std::size_t k = 0; k < need_.size(); ++k) {
      LatticeBox hull = need_[k];
      include(hull, member);
      const CellSet* set = chosen_[neighbours_[k]].set;
      const std::int64_t growth = set != nullptr ? 0 : volume(hull) - volume(need_[k]);
      if (best < need_.size() && growth >= least) continue;
      if (set != nullptr && !std::binary_search(set->begin(), set->end(), number)) continue;
      if (growth > 0 && !fits(allowed_, rules_, hull)) continue;
      best = k;
      least = growth;
      if (growth == 0) break;
    }
    return best;
  }

  LatticeCoverage drawnBack() const {
    LatticeCoverage coverage;
    for (const Chosen& c : chosen_) {
      if (c.set != nullptr) {
        coverage.sets.push_back(static_cast<std::size_t>(c.set - sets_.data()));
        continue;
      }
      CoverBox result;
      result.box = drawnBackTo(c.need, required_, allowed_, rules_);
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
  const std::vector<Cell> cells_;        ///< that are required, by their number
  const std::vector<LatticeBox> boxes_;  ///< candidates
  std::vector<std::int64_t> box_gain_;   ///< required cells that each of them stands for
  std::vector<Chosen> chosen_;
  std::vector<std::size_t> owner_;  ///< of each required cell, by its number
  std::vector<std::size_t> asked_;  ///< by box: who asks it just now, + 1
  // Of the box that is being dissolved:
  std::vector<std::size_t> neighbours_;
  std::vector<LatticeBox> need_;  ///< of the neighbours, with what they are to take over
  std::vector<std::size_t> to_;   ///< neighbour of each member
};

}  // namespace

std::vector<CoverBox> sweptOver(const BitGrid& required, const BitGrid& allowed,
                                const CoverRules& rules, std::size_t few) {
  std::vector<CoverBox> swept;
  if (static_cast<std::size_t>(required.count()) <= few) return swept;
  BitGrid left = required;
  required.forEach(required.window(), [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    if (!left.at(x, y, z)) return;
    const LatticeBox cell = boxOf({x, y, z});
    LatticeBox box = cell;  // also where no box of the least size has room
    forEachFit(allowed, rules, cell, [&](const LatticeBox& fit) {
      box = fit;  // the last one is the farthest ahead
      return true;
    });
    for (std::size_t k = 0; k < 3; ++k) allowed.extendUp(box, k);
    swept.emplace_back();
    swept.back().box = box;
    LatticeBox need = cell;
    const LatticeBox reach = grown(box, rules.tolerance);
    left.forEach(reach, [&](std::int32_t a, std::int32_t b, std::int32_t c) {
      swept.back().members.push_back({a, b, c});
      include(need, boxOf({a, b, c}));
    });
    left.clear(reach);
    forEachFit(allowed, rules, need, [&](const LatticeBox& least) {
      swept.back().box = least;
      return false;
    });
  });
  if (swept.size() <= few) swept.clear();
  return swept;
}

LatticeCoverage coverWithin(const BitGrid& required, const BitGrid& allowed,
                            const CoverRules& rules, const std::vector<CellSet>& sets,
                            CoverEffort effort) {
  return LatticeCover(required, allowed, rules, sets).run(effort);
}

}  // namespace planar_mapping::detail
