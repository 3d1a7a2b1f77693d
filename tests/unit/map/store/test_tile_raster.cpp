// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Whatever happens to the cells of a raster, and whenever it is committed, it holds what a plain
// map of cells would.
#include "planar_mapping/map/store/tile_raster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <utility>

#include "planar_mapping/base/random.h"

namespace planar_mapping::detail {
namespace {

using Cell = std::pair<std::int32_t, std::int32_t>;

std::int32_t whole(Random& random, std::int32_t low, std::int32_t high) {
  return static_cast<std::int32_t>(std::floor(random.uniform(low, high + 1.0)));
}
std::size_t bitOf(const Cell& cell) {
  return static_cast<std::size_t>(8 * (cell.second & 7) + (cell.first & 7));
}

/// A raster beside the plain map that says what it should hold.
class Twin {
 public:
  explicit Twin(std::uint64_t seed) : random_(seed) {
    raster_.setAnchor(whole(random_, -20, 20), whole(random_, -20, 20));
  }

  void set(const Cell& cell, std::uint8_t belief) {
    raster_.tileAt(cell.first >> 3, cell.second >> 3).setBelief(bitOf(cell), belief);
    raster_.markDirty(cell.first >> 3, cell.second >> 3);
    cells_[cell] = belief;
  }
  void remove(const Cell& cell) {
    if (cells_.erase(cell) == 0) return;
    raster_.find(cell.first >> 3, cell.second >> 3)->remove(bitOf(cell));
    raster_.markDirty(cell.first >> 3, cell.second >> 3);
  }
  /// A rectangle of cells of one belief, as walls are, or of beliefs that all differ.
  void change() {
    const Cell low{whole(random_, -200, 200), whole(random_, -60, 60)};
    const std::int32_t width = whole(random_, 1, 60), height = whole(random_, 1, 30);
    const bool away = random_.uniform(0.0, 1.0) < 0.3;
    const bool alike = random_.uniform(0.0, 1.0) < 0.5;
    const std::int32_t belief = whole(random_, 1, 17);
    for (std::int32_t b = 0; b < height; ++b) {
      for (std::int32_t a = 0; a < width; ++a) {
        const Cell cell{low.first + a, low.second + b};
        if (away) {
          remove(cell);
        } else {
          set(cell, static_cast<std::uint8_t>(alike ? belief : whole(random_, 1, 17)));
        }
      }
    }
  }
  void expectTheSame() {
    std::map<Cell, std::uint8_t> held;
    raster_.forEachTile([&](std::int32_t ta, std::int32_t tb, const RasterTile& tile) {
      for (std::size_t bit = 0; bit < 64; ++bit) {
        if ((tile.occupied() >> bit & 1u) == 0) continue;
        const auto at = static_cast<std::int32_t>(bit);
        held[{8 * ta + (at & 7), 8 * tb + (at >> 3)}] = tile.belief(bit);
      }
    });
    EXPECT_EQ(held, cells_);
    for (int i = 0; i < 20; ++i) {
      const Cell at{whole(random_, -220, 270), whole(random_, -80, 100)};
      const std::int32_t radius = whole(random_, 0, 40);
      const bool near = std::any_of(cells_.begin(), cells_.end(), [&](const auto& cell) {
        return std::abs(cell.first.first - at.first) <= radius &&
               std::abs(cell.first.second - at.second) <= radius;
      });
      EXPECT_EQ(raster_.anyWithin(at.first, at.second, radius), near);
      EXPECT_EQ(raster_.at(at.first, at.second), cells_.count(at) == 1);
    }
  }
  /// The tiles between the outermost cells.
  void expectTightWindow() {
    TileWindow tight;
    for (const auto& cell : cells_) tight.include(cell.first.first >> 3, cell.first.second >> 3);
    const TileWindow window = raster_.window();
    EXPECT_EQ(window.empty(), tight.empty());
    if (tight.empty()) return;
    EXPECT_EQ(window.low_a, tight.low_a);
    EXPECT_EQ(window.low_b, tight.low_b);
    EXPECT_EQ(window.high_a, tight.high_a);
    EXPECT_EQ(window.high_b, tight.high_b);
  }
  Random& random() { return random_; }
  TileRaster& raster() { return raster_; }

 private:
  Random random_;
  TileRaster raster_;
  std::map<Cell, std::uint8_t> cells_;
};

TEST(TileRaster, HoldsTheSameCellsWheneverItIsCommitted) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Twin twin(seed);
    for (std::uint32_t step = 1; step <= 12; ++step) {
      twin.change();
      if (twin.random().uniform(0.0, 1.0) > 0.5) continue;
      twin.raster().commit(step);
      twin.expectTightWindow();
      if (twin.random().uniform(0.0, 1.0) < 0.5) twin.expectTheSame();
    }
    twin.expectTheSame();
  }
}

TEST(TileRaster, StampsThePatchesThatChangedOnly) {
  Twin twin(3);
  TileRaster& raster = twin.raster();
  raster.setAnchor(0, 0);
  twin.set({10, 10}, 17);
  twin.set({10 + kPatchCells, 10}, 17);
  EXPECT_EQ(raster.commit(5), 2u);
  ASSERT_EQ(raster.patches().size(), 2u);
  EXPECT_EQ(raster.commit(5), 0u);
  twin.set({11 + kPatchCells, 10}, 17);
  EXPECT_EQ(raster.commit(6), 1u);
  EXPECT_EQ(raster.patches()[0].revision, 5u);
  EXPECT_EQ(raster.patches()[1].revision, 6u);
  raster.markAllDirty();
  EXPECT_EQ(raster.commit(7), 2u);
  EXPECT_EQ(raster.patches()[0].revision, 7u);
  twin.remove({10, 10});
  EXPECT_EQ(raster.commit(8), 1u);
  ASSERT_EQ(raster.patches().size(), 1u);
  EXPECT_EQ(raster.patches()[0].revision, 7u);
  twin.expectTheSame();
}

TEST(TileRaster, ForgetsTilesWithoutACell) {
  Twin twin(1);
  for (std::int32_t a = 0; a < 512; ++a) twin.set({a, 0}, 17);
  twin.raster().commit(1);
  for (std::int32_t a = 8; a < 512; ++a) twin.remove({a, 0});
  twin.raster().commit(2);
  EXPECT_NE(twin.raster().find(0, 0), nullptr);
  EXPECT_EQ(twin.raster().find(1, 0), nullptr);
  twin.expectTheSame();
}

}  // namespace
}  // namespace planar_mapping::detail
