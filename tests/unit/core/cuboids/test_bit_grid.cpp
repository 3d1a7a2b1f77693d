// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Bits are dealt with by words; here each answer is compared with that of cell by cell.
#include "planar_mapping/cuboids/cover/bit_grid.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "planar_mapping/base/random.h"

namespace planar_mapping::detail {
namespace {

/// Windows with less than a word, whole words, and some more, along x.
constexpr std::int32_t kWidths[] = {1, 5, 63, 64, 65, 128, 150};

BitGrid randomGrid(Random& random, std::int32_t width, std::int32_t depth, double fraction) {
  BitGrid grid(width, 7, depth);
  for (std::int32_t z = 0; z < depth; ++z) {
    for (std::int32_t y = 0; y < 7; ++y) {
      for (std::int32_t x = 0; x < width; ++x) {
        if (random.uniform() < fraction) grid.set(x, y, z);
      }
    }
  }
  return grid;
}

/// Within the window and not empty.
LatticeBox randomBox(Random& random, const BitGrid& grid) {
  LatticeBox box;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto size = static_cast<std::uint32_t>(grid.size()[k]);
    box.low[k] = static_cast<std::int32_t>(random.below(size));
    const auto most = size - static_cast<std::uint32_t>(box.low[k]);
    const std::uint32_t length = random.below(4) == 0 ? random.below(most) : 0;
    box.high[k] = box.low[k] + 1 + static_cast<std::int32_t>(length);
  }
  return box;
}

std::int64_t countOneByOne(const BitGrid& grid, const LatticeBox& box) {
  std::int64_t count = 0;
  for (std::int32_t z = box.low[2]; z < box.high[2]; ++z) {
    for (std::int32_t y = box.low[1]; y < box.high[1]; ++y) {
      for (std::int32_t x = box.low[0]; x < box.high[0]; ++x) count += grid.holds({x, y, z});
    }
  }
  return count;
}

std::int64_t volumeOf(const LatticeBox& box) {
  return std::int64_t{box.size(0)} * box.size(1) * box.size(2);
}

template <typename Visit>
void forRandomGrids(Visit&& visit) {
  Random random(9);
  for (const std::int32_t width : kWidths) {
    for (const std::int32_t depth : {1, 5}) {
      // Boxes grow far in an almost full grid only.
      for (const double fraction : {0.3, 0.9, 0.995, 1.0}) {
        const BitGrid grid = randomGrid(random, width, depth, fraction);
        for (int i = 0; i < 200; ++i) visit(grid, randomBox(random, grid));
      }
    }
  }
}

TEST(BitCount, CountsAsBitByBit) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    std::uint64_t bits = 0;
    std::size_t on = 0;
    const double fraction = random.uniform();
    for (int bit = 0; bit < 64; ++bit) {
      if (random.uniform() >= fraction) continue;
      bits |= std::uint64_t{1} << bit;
      ++on;
    }
    ASSERT_EQ(bitCount(bits), on);
  }
  EXPECT_EQ(bitCount(0), 0u);
  EXPECT_EQ(bitCount(~std::uint64_t{0}), 64u);
}

TEST(BitGrid, CountsAndTestsBoxesAsCellByCell) {
  forRandomGrids([](const BitGrid& grid, const LatticeBox& box) {
    const std::int64_t count = countOneByOne(grid, box);
    ASSERT_EQ(grid.count(box), count);
    ASSERT_EQ(grid.all(box), count == volumeOf(box));
    LatticeBox beyond = box;
    beyond.high[1] = grid.size()[1] + 1;
    ASSERT_FALSE(grid.all(beyond));
    ASSERT_EQ(grid.count(beyond), countOneByOne(grid, beyond));
  });
}

TEST(BitGrid, ExtendsBoxesAsLayerByLayer) {
  std::int64_t added = 0;
  forRandomGrids([&](const BitGrid& grid, const LatticeBox& box) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      LatticeBox expected = box;
      LatticeBox layer = box;
      const auto isOn = [&](std::int32_t at) {
        layer.low[axis] = at;
        layer.high[axis] = at + 1;
        return countOneByOne(grid, layer) == volumeOf(layer);
      };
      while (isOn(expected.high[axis])) ++expected.high[axis];
      LatticeBox extended = box;
      grid.extendUp(extended, axis);
      ASSERT_EQ(extended, expected) << "up along " << axis << " in " << grid.size()[0];
      while (isOn(expected.low[axis] - 1)) --expected.low[axis];
      grid.extendDown(extended, axis);
      ASSERT_EQ(extended, expected) << "down along " << axis << " in " << grid.size()[0];
      added += volumeOf(extended) - volumeOf(box);
    }
  });
  EXPECT_GT(added, 100000);
}

TEST(BitGrid, FillsAndClearsBoxes) {
  forRandomGrids([&](const BitGrid& grid, const LatticeBox& box) {
    BitGrid filled = grid;
    filled.fill(box);
    ASSERT_TRUE(filled.all(box));
    ASSERT_EQ(filled.count(), grid.count() - grid.count(box) + volumeOf(box));
    filled.clear(box);
    ASSERT_EQ(filled.count(box), 0);
    ASSERT_EQ(filled.count(), grid.count() - grid.count(box));
  });
}

TEST(BitGrid, CropsToAWindowOfItsOwn) {
  forRandomGrids([](const BitGrid& grid, const LatticeBox& box) {
    const BitGrid cropped = grid.cropped(box);
    ASSERT_EQ(cropped.count(), grid.count(box));
    cropped.forEach(cropped.window(), [&](std::int32_t x, std::int32_t y, std::int32_t z) {
      ASSERT_TRUE(grid.at(x + box.low[0], y + box.low[1], z + box.low[2]));
    });
  });
}

TEST(BitGrid, TheHullHoldsAllCellsAndNoEmptyRim) {
  forRandomGrids([](const BitGrid& grid, const LatticeBox& box) {
    BitGrid some(grid.size()[0], grid.size()[1], grid.size()[2]);
    ASSERT_EQ(volumeOf(some.hull()), 0);
    some.fill(box);
    ASSERT_EQ(some.hull(), box);
    const LatticeBox hull = grid.hull();
    ASSERT_EQ(grid.count(hull), grid.count());
    for (std::size_t axis = 0; axis < 3 && grid.count() > 0; ++axis) {
      LatticeBox low = hull;
      low.high[axis] = low.low[axis] + 1;
      LatticeBox high = hull;
      high.low[axis] = high.high[axis] - 1;
      ASSERT_GT(grid.count(low), 0);
      ASSERT_GT(grid.count(high), 0);
    }
  });
}

TEST(BitGrid, VisitsEachBlockInWhichACellIsOn) {
  forRandomGrids([](const BitGrid& full, const LatticeBox& box) {
    BitGrid grid(full.size()[0], full.size()[1], full.size()[2]);
    grid.fill(box);
    std::int64_t count = 0;
    grid.forEachBlock([&](const LatticeBox& block) {
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_EQ(block.low[k] % BitGrid::kBlock, 0);
        ASSERT_EQ(block.size(k), BitGrid::kBlock);
      }
      ASSERT_GT(grid.count(block), 0);
      count += grid.count(block);
    });
    ASSERT_EQ(count, volumeOf(box));
  });
}

TEST(BitGrid, DilatesByTheCellsBeside) {
  Random random(11);
  for (const std::int32_t width : kWidths) {
    const BitGrid grid = randomGrid(random, width, 5, 0.05);
    for (const std::array<std::int32_t, 3>& axes :
         {std::array<std::int32_t, 3>{1, 1, 1}, {1, 1, 0}, {0, 0, 1}, {0, 1, 0}}) {
      const BitGrid wide = grid.dilated(axes);
      for (std::int32_t z = 0; z < 5; ++z) {
        for (std::int32_t y = 0; y < 7; ++y) {
          for (std::int32_t x = 0; x < width; ++x) {
            const LatticeBox around{{x - axes[0], y - axes[1], z - axes[2]},
                                    {x + axes[0] + 1, y + axes[1] + 1, z + axes[2] + 1}};
            ASSERT_EQ(wide.at(x, y, z), countOneByOne(grid, around) > 0);
          }
        }
      }
    }
  }
}

TEST(CellNumbers, VisitsTheNumbersOfABox) {
  forRandomGrids([](const BitGrid& grid, const LatticeBox& box) {
    const CellNumbers numbers(grid);
    std::vector<std::size_t> expected;
    grid.forEach(box, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
      expected.push_back(numbers.at(x, y, z));
    });
    std::vector<std::size_t> visited;
    numbers.forEach(box, [&](std::size_t number) { visited.push_back(number); });
    ASSERT_EQ(visited, expected);
  });
}

}  // namespace
}  // namespace planar_mapping::detail
