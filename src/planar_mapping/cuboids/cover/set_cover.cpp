// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/cover/set_cover.h"

#include <algorithm>
#include <random>
#include <utility>

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kStepsPerSet = 2;
constexpr std::uint32_t kNoSet = 0xFFFFFFFFu;

/// A bit for each set, by chance one of 64: a list can only hold another one whose bits it has.
std::uint64_t marksOf(const CellSet& sets) {
  constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15u;
  std::uint64_t marks = 0;
  for (const std::uint32_t s : sets) marks |= std::uint64_t{1} << ((s * kGolden) >> 58);
  return marks;
}

/// For each element the sets that hold it; only of elements that no other one's sets all hold, as
/// whoever covers that other one covers these.
std::vector<CellSet> setsOfElements(std::size_t elements, const std::vector<CellSet>& sets) {
  std::vector<CellSet> all(elements);
  for (std::size_t s = 0; s < sets.size(); ++s) {
    for (const std::uint32_t e : sets[s]) all[e].push_back(static_cast<std::uint32_t>(s));
  }
  std::sort(all.begin(), all.end(), [](const CellSet& l, const CellSet& r) {
    return l.size() != r.size() ? l.size() < r.size() : l < r;
  });
  all.erase(std::unique(all.begin(), all.end()), all.end());
  struct Kept {
    std::uint64_t marks;
    std::size_t number;
  };
  std::vector<std::vector<Kept>> by_first(sets.size());
  std::vector<CellSet> kept;
  for (CellSet& own : all) {
    const std::uint64_t marks = marksOf(own);
    const auto isWithin = [&](const Kept& k) {
      const CellSet& other = kept[k.number];
      return (k.marks & ~marks) == 0 &&
             std::includes(own.begin(), own.end(), other.begin(), other.end());
    };
    const bool is_implied = std::any_of(own.begin(), own.end(), [&](std::uint32_t s) {
      return std::any_of(by_first[s].begin(), by_first[s].end(), isWithin);
    });
    if (is_implied) continue;
    by_first[own.front()].push_back({marks, kept.size()});
    kept.push_back(std::move(own));
  }
  return kept;
}

/// Takes sets out of a cover and puts others in until one fewer does. Elements that are left open
/// gain weight, so that the search turns to what is hard to cover.
class RowWeighting {
 public:
  RowWeighting(std::size_t sets, const std::vector<CellSet>& sets_of,
               const std::vector<std::size_t>& start)
      : sets_of_(sets_of),
        elements_of_(sets),
        covers_(sets_of.size(), 0),
        weight_(sets_of.size(), 1),
        place_(sets_of.size(), 0),
        score_(sets, 0),
        moved_(sets, 0),
        chosen_(sets, 0),
        may_enter_(sets, 1) {
    for (std::uint32_t e = 0; e < sets_of.size(); ++e) {
      for (const std::uint32_t s : sets_of[e]) {
        elements_of_[s].push_back(e);
        ++score_[s];
      }
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
    return best == kNoSet ? sets_of_[element].front() : best;
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

  const std::vector<CellSet>& sets_of_;  ///< by element
  std::vector<CellSet> elements_of_;     ///< by set
  std::vector<std::uint32_t> cover_;     ///< the sets that are chosen
  std::vector<std::uint32_t> open_;      ///< elements of none of them
  std::vector<std::uint32_t> covers_;    ///< how many of them hold an element
  std::vector<std::int64_t> weight_;     ///< of elements
  std::vector<std::size_t> place_;       ///< of elements in open_
  std::vector<std::int64_t> score_;      ///< weight of what is covered if the set is moved, less
                                         ///< that of what no longer is
  std::vector<std::size_t> moved_;       ///< step in which a set was last moved
  std::vector<std::uint8_t> chosen_;
  std::vector<std::uint8_t> may_enter_;
  std::size_t step_ = 0;
};

}  // namespace

std::vector<std::size_t> fewerSets(std::size_t elements, const std::vector<CellSet>& sets,
                                   const std::vector<std::size_t>& start) {
  const std::vector<CellSet> sets_of = setsOfElements(elements, sets);
  std::vector<std::size_t> cover =
      RowWeighting(sets.size(), sets_of, start).run(kStepsPerSet * sets.size());
  std::sort(cover.begin(), cover.end());
  return cover;
}

}  // namespace planar_mapping::detail
