// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/cover/set_cover.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping::detail {
namespace {

std::vector<std::size_t> allOf(const std::vector<CellSet>& sets) {
  std::vector<std::size_t> all(sets.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

std::size_t coveredBy(const std::vector<std::size_t>& cover, const std::vector<CellSet>& sets) {
  CellSet held;
  for (const std::size_t s : cover) held.insert(held.end(), sets[s].begin(), sets[s].end());
  std::sort(held.begin(), held.end());
  return static_cast<std::size_t>(std::unique(held.begin(), held.end()) - held.begin());
}

/// The fewest that do, by trying all selections.
std::size_t fewestOf(std::size_t elements, const std::vector<CellSet>& sets) {
  std::vector<std::uint32_t> masks;
  for (const CellSet& set : sets) {
    masks.push_back(0);
    for (const std::uint32_t e : set) masks.back() |= 1u << e;
  }
  std::size_t fewest = sets.size();
  for (std::uint32_t selection = 0; selection < 1u << sets.size(); ++selection) {
    std::uint32_t held = 0;
    for (std::size_t s = 0; s < sets.size(); ++s) held |= (selection >> s & 1u) ? masks[s] : 0u;
    if (held == (1u << elements) - 1) {
      fewest = std::min<std::size_t>(fewest, __builtin_popcount(selection));
    }
  }
  return fewest;
}

/// Elements along a line and intervals of it, which together hold all of it.
std::vector<CellSet> intervals(Random& random, std::uint32_t elements, std::size_t sets) {
  std::vector<CellSet> found;
  for (std::uint32_t e = 0; e < elements; e += 4) {
    found.emplace_back();
    for (std::uint32_t k = e; k < std::min(e + 4, elements); ++k) found.back().push_back(k);
  }
  while (found.size() < sets) {
    found.emplace_back();
    const std::uint32_t first = random.below(elements);
    const std::uint32_t last = std::min(first + 1 + random.below(8), elements);
    for (std::uint32_t k = first; k < last; ++k) found.back().push_back(k);
  }
  return found;
}

TEST(SetCover, FindsTheFewestOfSmallProblems) {
  Random random(5);
  for (int round = 0; round < 40; ++round) {
    constexpr std::size_t kElements = 18;
    std::vector<CellSet> sets = intervals(random, kElements, 8);
    while (sets.size() < 13) {  // and some that are none
      sets.emplace_back();
      for (std::uint32_t e = 0; e < kElements; ++e) {
        if (random.below(4) == 0) sets.back().push_back(e);
      }
    }
    const std::vector<std::size_t> cover = fewerSets(kElements, sets, allOf(sets));
    ASSERT_EQ(coveredBy(cover, sets), kElements) << "round " << round;
    EXPECT_EQ(cover.size(), fewestOf(kElements, sets)) << "round " << round;
    EXPECT_TRUE(std::is_sorted(cover.begin(), cover.end()));
  }
}

TEST(SetCover, LeavesWhatGreedySearchesRunInto) {
  // Two rows hold everything; greedy takes the columns, each of which holds more than is then left
  // of a row.
  std::vector<CellSet> sets(2);
  std::uint32_t next = 0;
  std::vector<std::size_t> columns;
  for (std::uint32_t width = 32; width > 0; width /= 2) {
    columns.push_back(sets.size());
    CellSet column;
    for (std::uint32_t row = 0; row < 2; ++row) {
      for (std::uint32_t k = 0; k < width; ++k) {
        sets[row].push_back(next);
        column.push_back(next++);
      }
    }
    sets.push_back(column);
  }
  ASSERT_EQ(coveredBy(columns, sets), next);
  EXPECT_EQ(fewerSets(next, sets, columns), (std::vector<std::size_t>{0, 1}));
}

TEST(SetCover, IsNeverMoreThanItStartsWith) {
  Random random(8);
  std::size_t fewer = 0;
  for (int round = 0; round < 20; ++round) {
    const std::uint32_t elements = 200 + random.below(200);
    const std::vector<CellSet> sets = intervals(random, elements, 400);
    std::vector<std::size_t> start(static_cast<std::size_t>((elements + 3) / 4));
    std::iota(start.begin(), start.end(), std::size_t{0});
    const std::vector<std::size_t> cover = fewerSets(elements, sets, start);
    ASSERT_EQ(coveredBy(cover, sets), elements);
    ASSERT_LE(cover.size(), start.size());
    fewer += cover.size() < start.size() ? 1 : 0;
    EXPECT_EQ(cover, fewerSets(elements, sets, start));  // nothing is left to chance
  }
  EXPECT_EQ(fewer, 20u);
}

TEST(SetCover, NothingNeedsNoSet) {
  EXPECT_TRUE(fewerSets(0, {}, {}).empty());
  EXPECT_TRUE(fewerSets(0, {{}, {}}, {0, 1}).empty());
  EXPECT_EQ(fewerSets(3, {{0, 1, 2}}, {0}), (std::vector<std::size_t>{0}));
}

}  // namespace
}  // namespace planar_mapping::detail
