// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/baselines/rectangular_approximation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <limits>
#include <map>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::evaluation {
namespace {

std::vector<GridCell> cellsOf(const GridBox& box) {
  std::vector<GridCell> cells;
  for (std::int32_t z = 0; z < box.size.z; ++z)
    for (std::int32_t y = 0; y < box.size.y; ++y)
      for (std::int32_t x = 0; x < box.size.x; ++x)
        cells.push_back({box.low.x + x, box.low.y + y, box.low.z + z});
  return cells;
}

std::vector<GridCell> cellsOf(const std::vector<GridBox>& boxes) {
  std::vector<GridCell> cells;
  for (const GridBox& box : boxes) {
    const std::vector<GridCell> some = cellsOf(box);
    cells.insert(cells.end(), some.begin(), some.end());
  }
  std::sort(cells.begin(), cells.end());
  return cells;
}

std::vector<GridCell> randomCells(std::uint64_t seed, std::int32_t side, double filled) {
  Random random(seed);
  std::vector<GridCell> cells;
  for (const GridCell& cell : cellsOf(GridBox{{-5, 3, 0}, {side, side, side}}))
    if (random.uniform() < filled) cells.push_back(cell);
  return cells;
}

/// Do two of the boxes share one complete face?
bool anyPairFuses(const std::vector<GridBox>& boxes) {
  for (const GridBox& a : boxes) {
    for (const GridBox& b : boxes) {
      const bool x = a.low.x + a.size.x == b.low.x && a.low.y == b.low.y && a.low.z == b.low.z &&
                     a.size.y == b.size.y && a.size.z == b.size.z;
      const bool y = a.low.y + a.size.y == b.low.y && a.low.x == b.low.x && a.low.z == b.low.z &&
                     a.size.x == b.size.x && a.size.z == b.size.z;
      const bool z = a.low.z + a.size.z == b.low.z && a.low.x == b.low.x && a.low.y == b.low.y &&
                     a.size.x == b.size.x && a.size.y == b.size.y;
      if (x || y || z) return true;
    }
  }
  return false;
}

TEST(FuseCells, ABlockBecomesOneBox) {
  const GridBox block{{-3, 2, 7}, {4, 5, 6}};
  const std::vector<GridBox> boxes = fuseCells(cellsOf(block));
  ASSERT_EQ(boxes.size(), 1u);
  EXPECT_EQ(boxes[0], block);
}

TEST(FuseCells, TheBestOrderOfTheAxesIsTakenForEachPart) {
  // Two combs far apart: the first has its teeth along x, the second along y. Fused along the
  // teeth each is four boxes (three teeth and the back), across them it is more.
  std::vector<GridCell> cells;
  for (std::int32_t tooth = 0; tooth < 3; ++tooth) {
    for (std::int32_t i = 1; i < 5; ++i) {
      cells.push_back({i, 2 * tooth, 0});
      cells.push_back({100 + 2 * tooth, i, 0});
    }
  }
  for (std::int32_t i = 0; i < 5; ++i) {
    cells.push_back({0, i, 0});
    cells.push_back({100 + i, 0, 0});
  }
  EXPECT_EQ(fuseCells(cells).size(), 8u);
}

TEST(FuseCells, BoxesAreDisjointCoverTheCellsAndNoPairIsLeftToFuse) {
  for (const double filled : {0.2, 0.5, 0.8, 0.95}) {
    const std::vector<GridCell> cells = randomCells(7, 9, filled);
    const std::vector<GridBox> boxes = fuseCells(cells);
    std::vector<GridCell> expected = cells;
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(cellsOf(boxes), expected) << filled;  // each cell once: no overlap
    EXPECT_FALSE(anyPairFuses(boxes)) << filled;
  }
}

TEST(Boxes, OfNothingAndOfOneCell) {
  for (const auto cover : {&fuseCells, &greedyCover}) {
    EXPECT_TRUE(cover({}).empty());
    EXPECT_EQ(cover({{5, -6, 7}}), (std::vector<GridBox>{{{5, -6, 7}, {1, 1, 1}}}));
  }
}

TEST(FuseCells, CellsAtTheEndOfTheNumberRangeDoNotWrapAround) {
  constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
  constexpr std::int32_t kLeast = std::numeric_limits<std::int32_t>::min();
  EXPECT_EQ(fuseCells({{kMost, 0, 0}, {kLeast, 0, 0}, {kMost - 1, 0, 0}}).size(), 2u);
}

TEST(GreedyCover, CoversTheCellsAndNothingElse) {
  for (const double filled : {0.2, 0.5, 0.8, 0.95}) {
    const std::vector<GridCell> cells = randomCells(13, 9, filled);
    const std::vector<GridBox> boxes = greedyCover(cells);
    std::vector<GridCell> covered = cellsOf(boxes);
    covered.erase(std::unique(covered.begin(), covered.end()), covered.end());
    std::vector<GridCell> expected = cells;
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(covered, expected) << filled;
  }
}

/// Least number of boxes, by trying all: for few cells.
std::size_t leastCover(const std::vector<GridCell>& cells) {
  std::map<GridCell, unsigned> number;
  for (const GridCell& cell : cells) number.emplace(cell, static_cast<unsigned>(number.size()));
  std::vector<unsigned> masks;
  for (const GridCell& a : cells) {
    for (const GridCell& b : cells) {
      if (b.x < a.x || b.y < a.y || b.z < a.z) continue;
      unsigned mask = 0;
      bool whole = true;
      for (const GridCell& cell :
           cellsOf(GridBox{a, {b.x - a.x + 1, b.y - a.y + 1, b.z - a.z + 1}})) {
        const auto found = number.find(cell);
        whole = whole && found != number.end();
        if (whole) mask |= 1u << found->second;
      }
      if (whole) masks.push_back(mask);
    }
  }
  const unsigned all = (1u << cells.size()) - 1;
  const std::function<bool(unsigned, std::size_t)> covers = [&](unsigned done, std::size_t left) {
    if (done == all) return true;
    if (left == 0) return false;
    const unsigned first = ~done & (done + 1);  // the lowest cell not covered yet
    return std::any_of(masks.begin(), masks.end(), [&](unsigned mask) {
      return (mask & first) != 0 && covers(done | mask, left - 1);
    });
  };
  std::size_t count = 0;
  while (!covers(0, count)) ++count;
  return count;
}

TEST(GreedyCover, IsNearTheLeastNumberOfBoxes) {
  std::size_t least = 0;
  std::size_t found = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const std::vector<GridCell> cells = randomCells(seed, 3, 0.55);
    if (cells.empty() || cells.size() > 18) continue;
    const std::size_t best = leastCover(cells);
    const std::size_t greedy = greedyCover(cells).size();
    EXPECT_GE(greedy, best) << seed;
    least += best;
    found += greedy;
  }
  EXPECT_GT(least, 200u);
  EXPECT_LE(static_cast<double>(found), 1.05 * static_cast<double>(least));
}

TEST(GreedyCover, CellsBeyondTheLatticeAreRefused) {
  constexpr std::int32_t kLast = (1 << 20) - 1;
  EXPECT_EQ(greedyCover({{kLast, -kLast - 1, 0}, {kLast - 1, -kLast - 1, 0}}).size(), 1u);
  EXPECT_THROW(greedyCover({{kLast + 1, 0, 0}}), InputError);
  EXPECT_THROW(greedyCover({{0, -kLast - 2, 0}}), InputError);
}

TEST(RectangularApproximation, CuboidsAreTheBoxesInMetres) {
  const RectangularApproximation grid(0.5, cellsOf(GridBox{{-2, 0, 4}, {2, 3, 1}}));
  const std::vector<Cuboid> cuboids = grid.cuboids();
  ASSERT_EQ(cuboids.size(), 1u);
  EXPECT_TRUE(cuboids[0].size.isApprox(Vector3(1.0, 1.5, 0.5)));
  EXPECT_TRUE(cuboids[0].center.isApprox(Vector3(-0.5, 0.75, 2.25)));
}

TEST(RectangularApproximation, FileTakesTheBitsOfCornersAndLengths) {
  EXPECT_EQ(RectangularApproximation(1.0, {}).fileBytes(), 42u);
  // Corners (0, 0, 0) and (5, 0, 0): six places, 3 bits; lengths up to 3 x 2 x 1: six, 3 bits.
  std::vector<GridCell> cells = cellsOf(GridBox{{0, 0, 0}, {3, 2, 1}});
  cells.push_back({5, 0, 0});
  const RectangularApproximation grid(1.0, cells);
  ASSERT_EQ(grid.size(), 2u);
  EXPECT_EQ(grid.fileBytes(), 42u + 2u);
}

TEST(RectangularApproximation, BoxesByDensityHoldAllCellsAndAsManyEmptyOnesAsAllowed) {
  Random random(9);
  std::vector<GridCell> cells;
  for (int i = 0; i < 400; ++i) {
    cells.push_back({static_cast<std::int32_t>(random.below(20)) - 10,
                     static_cast<std::int32_t>(random.below(6)),
                     static_cast<std::int32_t>(random.below(9))});
  }
  std::vector<GridCell> sorted = cells;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  for (const double density : {0.3, 0.5, 1.0}) {
    std::size_t held = 0;
    for (const GridBox& box : boxesByDensity(cells, density)) {
      const auto inside = std::count_if(sorted.begin(), sorted.end(), [&](const GridCell& cell) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const std::int32_t place = cell[axis] - box.low[axis];
          if (place < 0 || place >= box.size[axis]) return false;
        }
        return true;
      });
      EXPECT_GE(static_cast<double>(inside), density * static_cast<double>(box.cells()));
      held += static_cast<std::size_t>(inside);
    }
    EXPECT_EQ(held, sorted.size()) << density;  // each cell in one box
  }
  EXPECT_LT(boxesByDensity(cells, 0.3).size(), boxesByDensity(cells, 1.0).size());
  std::reverse(cells.begin(), cells.end());
  EXPECT_EQ(boxesByDensity(cells, 0.5), boxesByDensity(sorted, 0.5));
  EXPECT_TRUE(boxesByDensity({}, 0.5).empty());
}

TEST(RectangularApproximation, RefusesBadParameters) {
  EXPECT_THROW(RectangularApproximation(0.0, {}), ParameterError);
  EXPECT_THROW(boxesByDensity({}, 0.0), ParameterError);
  EXPECT_THROW(boxesByDensity({}, 1.5), ParameterError);
}

}  // namespace
}  // namespace planar_mapping::evaluation
