// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "evaluation/metrics/cuboid_geometry.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/cuboids/compact_cover.h"
#include "planar_mapping/cuboids/cover/set_cover.h"
#include "planar_mapping/cuboids/raster/plane_raster.h"

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

TEST(SetCover, SetsTwiceChangeNothing) {
  Random random(9);
  for (int round = 0; round < 20; ++round) {
    const std::uint32_t elements = 100 + random.below(100);
    std::vector<CellSet> sets = intervals(random, elements, 150);
    const std::vector<std::size_t> cover = fewerSets(elements, sets, allOf(sets));
    const std::vector<CellSet> once = sets;
    sets.insert(sets.end(), once.begin(), once.end());
    EXPECT_EQ(cover, fewerSets(elements, sets, allOf(sets))) << "round " << round;
  }
}

TEST(SetCover, NothingNeedsNoSet) {
  EXPECT_TRUE(fewerSets(0, {}, {}).empty());
  EXPECT_TRUE(fewerSets(0, {{}, {}}, {0, 1}).empty());
  EXPECT_EQ(fewerSets(3, {{0, 1, 2}}, {0}), (std::vector<std::size_t>{0}));
}

using test::boxesFor;
using test::cellAt;

// What was covered in parts is covered anew as a whole.

TEST(CoverAgain, JoinsWhatWasCoveredInParts) {
  const CuboidApproximationParams params;
  std::vector<NonPlanarCell> left, right, all;
  for (int x = 0; x < 10; ++x) {
    for (int y = 0; y < 3; ++y) (x < 4 ? left : right).push_back(cellAt(x, y, 0));
  }
  std::vector<Cuboid> boxes = boxesFor(left, {}, {}, params);
  for (const Cuboid& box : boxesFor(right, {}, {}, params)) boxes.push_back(box);
  ASSERT_EQ(boxes.size(), 2u);
  all = left;
  all.insert(all.end(), right.begin(), right.end());
  all.push_back(cellAt(30, 1, 0));  // which none of the boxes stands for
  const std::vector<Cuboid> again = coverAgain(boxes, all, {}, {}, params);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_TRUE(again.front().center.isApprox(Vector3(0.5, 0.15, 0.05)));
  EXPECT_TRUE(again.front().size.isApprox(Vector3(1.0, 0.3, 0.1)));
}

TEST(CoverAgain, KeepsBoxesWhereItFindsNoFewer) {
  const CuboidApproximationParams params;
  const std::vector<NonPlanarCell> cells{cellAt(0, 0, 0), cellAt(9, 0, 0)};
  std::vector<Cuboid> boxes = boxesFor(cells, {}, {}, params);
  ASSERT_EQ(boxes.size(), 2u);
  boxes.front().probability = 0.25f;  // so that they can be told apart
  EXPECT_EQ(coverAgain(boxes, cells, {}, {}, params).front().probability, 0.25f);
  // And drops what a cuboid stands for.
  Cuboid wall;
  wall.center = {0.05, 0.05, 0.05};
  wall.size = {0.1, 0.1, 0.1};
  const std::vector<Cuboid> again = coverAgain(boxes, cells, {}, {wall}, params);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_NEAR(again.front().center.x(), 0.95, 1e-9);
}

CellMask maskOf(const std::vector<std::string>& rows) {
  CellMask mask;
  mask.height = static_cast<std::int32_t>(rows.size());
  mask.width = static_cast<std::int32_t>(rows[0].size());
  for (const std::string& row : rows) {
    for (const char c : row) mask.cells.push_back(c == '#' ? 1 : 0);
  }
  return mask;
}

std::vector<int> coverCounts(const CellMask& mask, const std::vector<CellRectangle>& rectangles) {
  std::vector<int> counts(mask.cells.size(), 0);
  for (const CellRectangle& r : rectangles) {
    for (std::int32_t b = r.b; b < r.b + r.height; ++b) {
      for (std::int32_t a = r.a; a < r.a + r.width; ++a)
        ++counts[static_cast<std::size_t>(b - mask.b0) * mask.width + (a - mask.a0)];
    }
  }
  return counts;
}

TEST(SplitAndMerge, DenseUnitIsNotSplit) {
  // 15 of 16 cells: density 0.9375 is above the threshold, so the hole stays inside.
  const std::vector<CellRectangle> r =
      splitAndMerge(maskOf({"####", "####", "####", "###."}), 0.9, 1, 1);
  EXPECT_EQ(r, (std::vector<CellRectangle>{{0, 0, 4, 4}}));
}

TEST(SplitAndMerge, QuartersThenMergesAlongUThenAlongV) {
  // Three full quarters: the lower two merge along u, the upper one has another width.
  const CellMask mask = maskOf({"####", "####", "##..", "##.."});
  const std::vector<CellRectangle> merged = splitAndMerge(mask, 0.9, 1, 1);
  EXPECT_EQ(merged, (std::vector<CellRectangle>{{0, 0, 4, 2}, {0, 2, 2, 2}}));
  EXPECT_EQ(splitAndMerge(mask, 0.9, 1, 1, false).size(), 3u);
}

TEST(SplitAndMerge, MergesEqualWidthsAlongV) {
  // Both left quarters are full, both right ones empty.
  const std::vector<CellRectangle> r =
      splitAndMerge(maskOf({"##..", "##..", "##..", "##.#"}), 0.9, 1, 1);
  EXPECT_EQ(r, (std::vector<CellRectangle>{{0, 0, 2, 4}, {3, 3, 1, 1}}));
}

TEST(SplitAndMerge, StopsAtTheSizeThresholds) {
  const CellMask mask = maskOf({"#...", "....", "....", "...#"});
  const std::vector<CellRectangle> r = splitAndMerge(mask, 0.9, 2, 2);
  EXPECT_EQ(r, (std::vector<CellRectangle>{{0, 0, 2, 2}, {2, 2, 2, 2}}));
  EXPECT_EQ(splitAndMerge(mask, 0.9, 4, 1).size(), 1u);  // as wide as W_T: not wider
}

TEST(SplitAndMerge, StartsFromTheBoundingRectangleOfTheCells) {
  CellMask mask = maskOf({"......", ".##...", ".##...", "......"});
  mask.a0 = 10;
  mask.b0 = -20;
  const std::vector<CellRectangle> r = splitAndMerge(mask, 1.0, 1, 1);
  EXPECT_EQ(r, (std::vector<CellRectangle>{{11, -19, 2, 2}}));
}

TEST(SplitAndMerge, CoversEveryCellOnceAndMergingKeepsTheArea) {
  Random random(5);
  for (int run = 0; run < 100; ++run) {
    CellMask mask;
    mask.width = 1 + static_cast<std::int32_t>(random.below(40));
    mask.height = 1 + static_cast<std::int32_t>(random.below(40));
    mask.a0 = -17;
    mask.b0 = 23;
    const double density = random.uniform();
    for (std::int32_t i = 0; i < mask.width * mask.height; ++i)
      mask.cells.push_back(random.uniform() < density);
    const auto split = splitAndMerge(mask, 0.8, 1, 1, false);
    const auto merged = splitAndMerge(mask, 0.8, 1, 1, true);
    EXPECT_LE(merged.size(), split.size());
    const std::vector<int> counts = coverCounts(mask, merged);
    EXPECT_EQ(counts, coverCounts(mask, split));
    for (std::size_t i = 0; i < counts.size(); ++i) {
      EXPECT_LE(counts[i], 1);
      EXPECT_GE(counts[i], mask.cells[i] ? 1 : 0);
    }
  }
}

TEST(SplitAndMerge, NothingGivesNothingAndBadParametersAreNamed) {
  EXPECT_TRUE(splitAndMerge(CellMask(), 0.9, 1, 1).empty());
  EXPECT_TRUE(splitAndMerge(maskOf({"..", ".."}), 0.9, 1, 1).empty());
  EXPECT_THROW(splitAndMerge(maskOf({"#"}), 0.0, 1, 1), ParameterError);
  EXPECT_THROW(splitAndMerge(maskOf({"#"}), std::nan(""), 1, 1), ParameterError);
  EXPECT_THROW(splitAndMerge(maskOf({"#"}), 0.9, 0, 1), ParameterError);
  CellMask broken = maskOf({"##"});
  broken.height = 2;
  EXPECT_THROW(splitAndMerge(broken, 0.9, 1, 1), InputError);
}

}  // namespace
}  // namespace planar_mapping::detail
