// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/cover/set_cover.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <utility>

#include "planar_mapping/base/lists.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kStepsPerSet = 2;
constexpr std::uint32_t kNoSet = 0xFFFFFFFFu;

/// Lists of numbers, one after another in memory.
class Lists {
 public:
  struct List {
    const std::uint32_t* first;
    const std::uint32_t* last;

    const std::uint32_t* begin() const { return first; }
    const std::uint32_t* end() const { return last; }
    std::size_t size() const { return static_cast<std::size_t>(last - first); }
    bool operator<(const List& other) const {
      return std::lexicographical_compare(first, last, other.first, other.last);
    }
    bool operator==(const List& other) const {
      return std::equal(first, last, other.first, other.last);
    }
  };

  std::size_t size() const { return begin_.size() - 1; }
  List operator[](std::size_t i) const {
    return {items_.data() + begin_[i], items_.data() + begin_[i + 1]};
  }
  template <typename List>
  void add(const List& list) {
    items_.insert(items_.end(), list.begin(), list.end());
    close();
  }
  void push(std::uint32_t number) { items_.push_back(number); }
  /// What was pushed is a list.
  void close() { begin_.push_back(static_cast<std::uint32_t>(items_.size())); }

  /// For each number below \p count the lists that hold it, ascending.
  template <typename Source>
  static Lists holders(std::size_t count, const Source& lists) {
    Lists all;
    all.begin_.assign(count + 1, 0);
    for (std::size_t i = 0; i < lists.size(); ++i)
      for (const std::uint32_t n : lists[i]) ++all.begin_[n + 1];
    std::partial_sum(all.begin_.begin(), all.begin_.end(), all.begin_.begin());
    all.items_.resize(all.begin_.back());
    std::vector<std::uint32_t> next(all.begin_.begin(), all.begin_.end() - 1);
    for (std::uint32_t i = 0; i < lists.size(); ++i)
      for (const std::uint32_t n : lists[i]) all.items_[next[n]++] = i;
    return all;
  }

 private:
  std::vector<std::uint32_t> begin_ = {0};
  std::vector<std::uint32_t> items_;
};

/// A bit for each number, by chance one of 64: a list can only hold another one whose bits it has.
std::uint64_t marksOf(const Lists::List& numbers) {
  constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15u;
  std::uint64_t marks = 0;
  for (const std::uint32_t n : numbers) marks |= std::uint64_t{1} << ((n * kGolden) >> 58);
  return marks;
}

/// Of lists of sets, each of the sets that hold an element, those that hold no other list: whoever
/// covers the element of the other one covers theirs.
/// \param sets  number of all
Lists hardest(const Lists& all, std::size_t sets) {
  std::vector<std::uint32_t> order(all.size());
  std::iota(order.begin(), order.end(), std::uint32_t{0});
  std::sort(order.begin(), order.end(), [&](std::uint32_t l, std::uint32_t r) {
    return all[l].size() != all[r].size() ? all[l].size() < all[r].size() : all[l] < all[r];
  });
  struct Kept {
    std::uint64_t marks;
    std::uint32_t number;
  };
  std::vector<std::vector<Kept>> by_first(sets);
  Lists kept;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Lists::List own = all[order[i]];
    if (own.size() == 0 || (i > 0 && own == all[order[i - 1]])) continue;
    const std::uint64_t marks = marksOf(own);
    const auto isWithin = [&](const Kept& k) {
      const Lists::List other = all[k.number];
      return (k.marks & ~marks) == 0 &&
             std::includes(own.begin(), own.end(), other.begin(), other.end());
    };
    const bool is_implied = std::any_of(own.begin(), own.end(), [&](std::uint32_t s) {
      return std::any_of(by_first[s].begin(), by_first[s].end(), isWithin);
    });
    if (is_implied) continue;
    by_first[*own.begin()].push_back({marks, order[i]});
    kept.add(own);
  }
  return kept;
}

/// For each set the first one with the same elements; none for a set without elements.
/// \param sets_of  for each element the sets that hold it
std::vector<std::uint32_t> firstAlike(std::size_t sets, const Lists& sets_of) {
  const Lists elements_of = Lists::holders(sets, sets_of);
  std::vector<std::uint32_t> first(sets, kNoSet);
  for (std::uint32_t s = 0; s < sets; ++s) {
    const Lists::List own = elements_of[s];
    if (own.size() == 0) continue;
    const Lists::List others = sets_of[*own.begin()];
    first[s] = *std::find_if(others.begin(), others.end(),
                             [&](std::uint32_t other) { return elements_of[other] == own; });
  }
  return first;
}

/// Takes sets out of a cover and puts others in until one fewer does. Elements that are left open
/// gain weight, so that the search turns to what is hard to cover.
class RowWeighting {
 public:
  RowWeighting(std::size_t sets, const Lists& sets_of, const std::vector<std::size_t>& start)
      : sets_of_(sets_of),
        elements_of_(Lists::holders(sets, sets_of)),
        covers_(sets_of.size(), 0),
        weight_(sets_of.size(), 1),
        place_(sets_of.size(), 0),
        score_(sets, 0),
        moved_(sets, 0),
        chosen_(sets, 0),
        may_enter_(sets, 1) {
    for (std::uint32_t e = 0; e < sets_of.size(); ++e) {
      for (const std::uint32_t s : sets_of[e]) ++score_[s];
      leaveOpen(e);
    }
    for (const std::size_t s : start) add(static_cast<std::uint32_t>(s));
  }

  std::vector<std::size_t> run(std::size_t steps) {
    std::vector<std::uint32_t> best = cover_;
    std::minstd_rand random;
    std::uint32_t added = kNoSet;
    for (step_ = 1; step_ <= steps; ++step_) {
      while (open_.empty() && !cover_.empty()) {
        best = cover_;
        remove(leastMissed(kNoSet));
      }
      if (cover_.empty()) break;  // one set holds everything, or nothing is to be covered
      remove(leastMissed(added));
      added = bestFor(open_[random() % open_.size()]);
      add(added);
      for (const std::uint32_t e : open_) {
        ++weight_[e];
        for (const std::uint32_t s : sets_of_[e]) ++score_[s];
      }
    }
    if (open_.empty() && cover_.size() < best.size()) best = cover_;
    return {best.begin(), best.end()};
  }

 private:
  void leaveOpen(std::uint32_t e) {
    place_[e] = open_.size();
    open_.push_back(e);
  }

  void close(std::uint32_t e) {
    place_[open_.back()] = place_[e];
    open_[place_[e]] = open_.back();
    open_.pop_back();
  }

  /// Better to move; of equals the one that has not been moved for longest.
  bool isBetter(std::uint32_t s, std::uint32_t than) const {
    if (than == kNoSet || score_[s] != score_[than])
      return than == kNoSet || score_[s] > score_[than];
    return moved_[s] < moved_[than];
  }

  /// Of the cover the set without which least is open; not \p added unless it is the only one.
  std::uint32_t leastMissed(std::uint32_t added) const {
    std::uint32_t best = kNoSet;
    for (const std::uint32_t s : cover_) {
      if (s != added && isBetter(s, best)) best = s;
    }
    return best == kNoSet ? added : best;
  }

  std::uint32_t bestFor(std::uint32_t element) const {
    std::uint32_t best = kNoSet;
    for (const std::uint32_t s : sets_of_[element]) {
      if (may_enter_[s] != 0 && isBetter(s, best)) best = s;
    }
    return best == kNoSet ? *sets_of_[element].begin() : best;
  }

  void flip(std::uint32_t s) {
    chosen_[s] ^= 1;
    score_[s] = -score_[s];
    moved_[s] = step_;
  }

  void add(std::uint32_t s) {
    flip(s);
    cover_.push_back(s);
    for (const std::uint32_t e : elements_of_[s]) {
      if (++covers_[e] == 1) close(e);
      for (const std::uint32_t other : sets_of_[e]) {
        if (other == s) continue;
        may_enter_[other] = 1;
        if (covers_[e] == 1) score_[other] -= weight_[e];
        if (covers_[e] == 2 && chosen_[other] != 0) score_[other] += weight_[e];
      }
    }
  }

  void remove(std::uint32_t s) {
    flip(s);
    cover_.erase(std::find(cover_.begin(), cover_.end(), s));
    for (const std::uint32_t e : elements_of_[s]) {
      if (--covers_[e] == 0) leaveOpen(e);
      for (const std::uint32_t other : sets_of_[e]) {
        if (other == s) continue;
        may_enter_[other] = 1;
        if (covers_[e] == 0) score_[other] += weight_[e];
        if (covers_[e] == 1 && chosen_[other] != 0) score_[other] -= weight_[e];
      }
    }
    may_enter_[s] = 0;  // not until something beside it has changed
  }

  const Lists& sets_of_;               ///< by element
  const Lists elements_of_;            ///< by set
  std::vector<std::uint32_t> cover_;   ///< the sets that are chosen
  std::vector<std::uint32_t> open_;    ///< elements of none of them
  std::vector<std::uint32_t> covers_;  ///< how many of them hold an element
  std::vector<std::int64_t> weight_;   ///< of elements
  std::vector<std::size_t> place_;     ///< of elements in open_
  std::vector<std::int64_t> score_;    ///< weight of what is covered if the set is moved, less
                                       ///< that of what no longer is
  std::vector<std::size_t> moved_;     ///< step in which a set was last moved
  std::vector<std::uint8_t> chosen_;
  std::vector<std::uint8_t> may_enter_;
  std::size_t step_ = 0;
};

}  // namespace

std::vector<std::size_t> fewerSets(std::size_t elements, const std::vector<CellSet>& sets,
                                   const std::vector<std::size_t>& start) {
  const Lists hard = hardest(Lists::holders(elements, sets), sets.size());
  const std::vector<std::uint32_t> first = firstAlike(sets.size(), hard);
  // The search is among sets that differ, by numbers of their own.
  std::vector<std::size_t> kept;
  std::vector<std::uint32_t> number(sets.size(), kNoSet);
  for (std::uint32_t s = 0; s < sets.size(); ++s) {
    if (first[s] != s) continue;
    number[s] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(s);
  }
  Lists rows;
  for (std::size_t e = 0; e < hard.size(); ++e) {
    for (const std::uint32_t s : hard[e])
      if (number[s] != kNoSet) rows.push(number[s]);
    rows.close();
  }
  std::vector<std::size_t> begun;
  for (const std::size_t s : start)
    if (first[s] != kNoSet) begun.push_back(number[first[s]]);
  makeDistinct(begun);
  std::vector<std::size_t> cover =
      RowWeighting(kept.size(), rows, begun).run(kStepsPerSet * kept.size());
  for (std::size_t& s : cover) s = kept[s];
  std::sort(cover.begin(), cover.end());
  return cover;
}

}  // namespace planar_mapping::detail
