// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/cover/lattice_boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "planar_mapping/base/random.h"
#include "planar_mapping/cuboids/cover/lattice_cover.h"

namespace planar_mapping::detail {
namespace {

/// A few boxes and single cells, with a rim in which nothing is on.
BitGrid clutter(Random& random) {
  BitGrid grid(40, 24, 16);
  const auto place = [&](std::uint32_t size) {
    return 2 + static_cast<std::int32_t>(random.below(size - 4));
  };
  for (int i = 0; i < 6; ++i) {
    const LatticeCell low{place(40), place(24), place(16)};
    LatticeCell high = low;
    for (std::size_t k = 0; k < 3; ++k) {
      high[k] =
          std::min(low[k] + 1 + static_cast<std::int32_t>(random.below(10)), grid.size()[k] - 2);
    }
    grid.fill({low, high});
  }
  for (int i = 0; i < 10; ++i) grid.set(place(40), place(24), place(16));
  return grid;
}

const CoverRules kRules{{1, 1, 1}, {2, 2, 2}};

bool standsFor(const LatticeBox& box, const LatticeCell& cell) {
  return meet(grown(box, kRules.tolerance), boxOf(cell));
}

TEST(LatticeBoxes, TheLargestHoldAllowedCellsAndCannotGrow) {
  Random random(3);
  for (int round = 0; round < 20; ++round) {
    const BitGrid required = clutter(random);
    const BitGrid allowed = required.dilated({1, 1, 1});
    const std::vector<LatticeBox> boxes = largestBoxes(required, allowed, kRules);
    ASSERT_TRUE(std::is_sorted(boxes.begin(), boxes.end()));
    for (const LatticeBox& box : boxes) {
      ASSERT_TRUE(allowed.all(box));
      for (std::size_t k = 0; k < 3; ++k) {
        LatticeBox more = box;
        ++more.high[k];
        ASSERT_FALSE(allowed.all(more));
        more = box;
        --more.low[k];
        ASSERT_FALSE(allowed.all(more));
      }
    }
    for (const LatticeCell& cell : listCells(required)) {
      ASSERT_TRUE(std::any_of(boxes.begin(), boxes.end(),
                              [&](const LatticeBox& box) { return standsFor(box, cell); }));
    }
  }
}

TEST(LatticeBoxes, NoCoverHasFewerThanTheBound) {
  Random random(4);
  std::size_t bounds = 0;
  std::size_t found = 0;
  for (int round = 0; round < 30; ++round) {
    const BitGrid required = clutter(random);
    const BitGrid allowed = required.dilated({1, 1, 1});
    const std::size_t boxes = coverWithin(required, allowed, kRules).boxes.size();
    const std::size_t bound = fewestBoxes(required, allowed, kRules, 1000);
    ASSERT_GE(bound, 1u);
    ASSERT_LE(bound, boxes);
    ASSERT_EQ(fewestBoxes(required, allowed, kRules, 2), std::min<std::size_t>(bound, 2));
    bounds += bound;
    found += boxes;
  }
  EXPECT_GT(10 * bounds, 8 * found);  // near enough to be of use
}

TEST(LatticeBoxes, TheBoundOfNothingIsNone) {
  const BitGrid none(5, 5, 5);
  EXPECT_EQ(fewestBoxes(none, none, kRules, 3), 0u);
  EXPECT_TRUE(largestBoxes(none, none, kRules).empty());
}

TEST(LatticeCover, EachCellIsInOneBoxOrSetThatStandsForIt) {
  Random random(6);
  for (int round = 0; round < 20; ++round) {
    const BitGrid required = clutter(random);
    const BitGrid allowed = required.dilated({1, 1, 1});
    const std::vector<LatticeCell> cells = listCells(required);
    std::vector<CellSet> sets(3);
    for (CellSet& set : sets) {
      const std::uint32_t first = random.below(static_cast<std::uint32_t>(cells.size()));
      const std::uint32_t last =
          first + random.below(static_cast<std::uint32_t>(cells.size()) - first);
      for (std::uint32_t n = first; n <= last; n += 2) set.push_back(n);
    }
    const LatticeCoverage cover = coverWithin(required, allowed, kRules, sets);
    const CellNumbers numbers(required);
    std::vector<int> times(cells.size(), 0);
    for (const CoverBox& box : cover.boxes) {
      ASSERT_TRUE(allowed.all(box.box));
      for (const LatticeCell& m : box.members) {
        ASSERT_TRUE(standsFor(box.box, m));
        ++times[numbers.at(m[0], m[1], m[2])];
      }
    }
    for (std::size_t n = 0; n < cells.size(); ++n) {
      ASSERT_LE(times[n], 1);
      const bool in_set = std::any_of(cover.sets.begin(), cover.sets.end(), [&](std::size_t s) {
        return std::binary_search(sets[s].begin(), sets[s].end(), n);
      });
      ASSERT_TRUE(times[n] == 1 || in_set);
    }
    ASSERT_LE(cover.boxes.size() + cover.sets.size(),
              coverWithin(required, allowed, kRules).boxes.size());
  }
}

TEST(LatticeCover, ClutterIsSweptOverByBoxesThatStandForAllOfIt) {
  Random random(8);
  BitGrid required(44, 44, 44);
  for (int i = 0; i < 9000; ++i) {
    const auto place = [&] { return 2 + static_cast<std::int32_t>(random.below(40)); };
    const std::int32_t x = place(), y = place();
    required.set(x, y, place());
  }
  const BitGrid allowed = required.dilated({1, 1, 1});
  const auto cells = static_cast<std::size_t>(required.count());
  ASSERT_GT(cells, 8000u);
  const std::vector<CoverBox> swept = sweptOver(required, allowed, kRules, 100);
  EXPECT_GT(swept.size(), 100u);
  EXPECT_LT(3 * swept.size(), cells);
  BitGrid left = required;
  std::size_t members = 0;
  for (const CoverBox& box : swept) {
    ASSERT_TRUE(allowed.all(box.box));
    for (const LatticeCell& m : box.members) {
      ASSERT_TRUE(standsFor(box.box, m));
      left.reset(m[0], m[1], m[2]);
      ++members;
    }
  }
  EXPECT_EQ(members, cells);
  EXPECT_EQ(left.count(), 0);
  // What can be searched is.
  EXPECT_TRUE(sweptOver(required, allowed, kRules, swept.size()).empty());
  EXPECT_TRUE(sweptOver(required, allowed, kRules, cells).empty());
}

/// Exact covers forbid what lies beside a half cell: no box of a whole cell has room then.
TEST(LatticeCover, WhereNoBoxHasRoomACellIsABox) {
  const CoverRules exact{{0, 0, 0}, {2, 2, 2}};
  BitGrid required(44, 44, 44);
  for (std::int32_t x = 2; x < 42; x += 3) {
    for (std::int32_t y = 2; y < 42; y += 3) {
      for (std::int32_t z = 2; z < 42; z += 3) required.set(x, y, z);
    }
  }
  required.fill({{2, 2, 2}, {4, 4, 4}});
  const std::int64_t cells = required.count();
  const auto expectAll = [&](const std::vector<CoverBox>& boxes) {
    EXPECT_EQ(boxes.size(), static_cast<std::size_t>(cells) - 7);
    BitGrid left = required;
    for (const CoverBox& box : boxes) {
      EXPECT_FALSE(box.members.empty());
      EXPECT_TRUE(required.all(box.box));
      for (std::size_t k = 0; k < 3; ++k) EXPECT_GT(box.box.size(k), 0);
      left.clear(box.box);
    }
    EXPECT_EQ(left.count(), 0);
  };
  expectAll(sweptOver(required, required, exact, 100));
  expectAll(coverWithin(required, required, exact, {}, CoverEffort::Full).boxes);
}

TEST(LatticeCover, FullEffortFindsFewerForCurvedSurfaces) {
  Random random(2);
  std::size_t quick = 0;
  std::size_t full = 0;
  for (int round = 0; round < 6; ++round) {
    // The cells of a sphere's shell.
    BitGrid required(48, 48, 48);
    const double radius = 12.0 + random.below(8);
    for (std::int32_t i = 0; i < 48 * 48 * 48; ++i) {
      const LatticeCell at{i % 48, i / 48 % 48, i / (48 * 48)};
      const double distance = std::hypot(at[0] - 23.5, at[1] - 23.5, at[2] - 23.5);
      if (std::abs(distance - radius) < 0.9) required.set(at[0], at[1], at[2]);
    }
    const BitGrid allowed = required.dilated({1, 1, 1});
    const LatticeCoverage cover = coverWithin(required, allowed, kRules, {}, CoverEffort::Full);
    BitGrid left = required;
    for (const CoverBox& c : cover.boxes) {
      ASSERT_TRUE(allowed.all(c.box));
      left.clear(grown(c.box, kRules.tolerance));
    }
    EXPECT_EQ(left.count(), 0);
    quick += coverWithin(required, allowed, kRules).boxes.size();
    full += cover.boxes.size();
  }
  EXPECT_LT(20 * full, 19 * quick) << full << " of " << quick;
}

}  // namespace
}  // namespace planar_mapping::detail
