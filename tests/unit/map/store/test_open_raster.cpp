// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Rasters of planes are packed between frames. Whatever happens to their cells, and whenever they
// are packed, they hold what a plain map of cells would.
#include "store/open_raster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <utility>
#include <vector>

#include "planar_mapping/core/base/detail/random.h"

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
  void pack(std::uint32_t revision) {
    PackWriter out;
    EXPECT_EQ(raster_.pack(revision, out), !cells_.empty());
    bytes_.swap(out.bytes);
    raster_ = OpenRaster(PackReader(bytes_.data()));
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
  OpenRaster& raster() { return raster_; }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  Random random_;
  OpenRaster raster_;
  std::map<Cell, std::uint8_t> cells_;
  std::vector<std::uint8_t> bytes_;
};

TEST(OpenRaster, HoldsTheSameCellsWheneverItIsPacked) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Twin twin(seed);
    for (std::uint32_t step = 1; step <= 12; ++step) {
      twin.change();
      if (twin.random().uniform(0.0, 1.0) > 0.5) continue;
      twin.pack(step);
      twin.expectTightWindow();
      if (twin.random().uniform(0.0, 1.0) < 0.5) twin.expectTheSame();
    }
    twin.expectTheSame();
  }
}

TEST(OpenRaster, PacksToTheSameBytesHoweverItCameAbout) {
  Twin often(7), once(7);
  for (std::uint32_t step = 1; step <= 12; ++step) {
    often.change();
    once.change();
    often.pack(1);
  }
  once.pack(1);
  EXPECT_EQ(often.bytes(), once.bytes());
}

TEST(OpenRaster, StampsThePatchesThatChangedOnly) {
  Twin twin(3);
  twin.raster().setAnchor(0, 0);
  twin.set({10, 10}, 17);
  twin.set({10 + kPatchCells, 10}, 17);
  twin.pack(5);
  ASSERT_EQ(twin.raster().patches(), 2u);
  EXPECT_EQ(twin.raster().dirtyPatches(), 0u);
  twin.set({11 + kPatchCells, 10}, 17);
  EXPECT_EQ(twin.raster().dirtyPatches(), 1u);
  twin.pack(6);
  EXPECT_EQ(twin.raster().revision(0), 5u);
  EXPECT_EQ(twin.raster().revision(1), 6u);
  twin.raster().markAllDirty();
  twin.pack(7);
  EXPECT_EQ(twin.raster().revision(0), 7u);
  twin.remove({10, 10});
  twin.pack(8);
  ASSERT_EQ(twin.raster().patches(), 1u);
  EXPECT_EQ(twin.raster().revision(0), 7u);
  twin.expectTheSame();
}

TEST(OpenRaster, TakesFewBytes) {
  Twin wall(1);
  for (std::int32_t b = 0; b < 24; ++b) {
    for (std::int32_t a = 0; a < 128; ++a) wall.set({a, b}, 17);
  }
  wall.pack(1);
  EXPECT_LT(wall.bytes().size(), 48u * 3u + 40u);  // of 48 tiles
  Twin doubtful(2);
  for (std::int32_t b = 0; b < 64; ++b) {
    for (std::int32_t a = 0; a < 64; ++a) {
      doubtful.set({a, b}, static_cast<std::uint8_t>(whole(doubtful.random(), 1, 17)));
    }
  }
  doubtful.pack(1);
  EXPECT_LE(doubtful.bytes().size(), 64u * 43u + 80u);  // five bits each
}

}  // namespace
}  // namespace planar_mapping::detail
