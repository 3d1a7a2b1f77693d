// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/cuboids/raster/plane_raster.h"

namespace planar_mapping::detail {
namespace {

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
