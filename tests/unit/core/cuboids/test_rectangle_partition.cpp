// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <unordered_map>
#include <vector>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"
#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping {
namespace {

CellMask maskOf(const std::vector<std::string>& rows) {
  CellMask mask;
  mask.height = static_cast<std::int32_t>(rows.size());
  mask.width = rows.empty() ? 0 : static_cast<std::int32_t>(rows[0].size());
  for (const std::string& row : rows) {
    for (const char c : row) mask.cells.push_back(c == '#' ? 1 : 0);
  }
  return mask;
}

CellMask maskOf(std::uint64_t bits, std::int32_t width, std::int32_t height) {
  CellMask mask;
  mask.width = width;
  mask.height = height;
  for (std::int32_t i = 0; i < width * height; ++i) mask.cells.push_back((bits >> i) & 1u);
  return mask;
}

CellMask randomMask(Random& random, std::int32_t width, std::int32_t height, double density) {
  CellMask mask;
  mask.width = width;
  mask.height = height;
  for (std::int32_t i = 0; i < width * height; ++i) {
    mask.cells.push_back(random.uniform() < density ? 1 : 0);
  }
  return mask;
}

/// Each occupied cell in exactly one rectangle, each empty cell in none.
::testing::AssertionResult coversExactly(const CellMask& mask,
                                         const std::vector<CellRectangle>& rectangles) {
  std::vector<int> covered(mask.cells.size(), 0);
  for (const CellRectangle& r : rectangles) {
    for (std::int32_t b = r.b - mask.b0; b < r.b - mask.b0 + r.height; ++b) {
      for (std::int32_t a = r.a - mask.a0; a < r.a - mask.a0 + r.width; ++a) {
        if (!mask.at(a, b)) {
          return ::testing::AssertionFailure() << "covers the empty cell " << a << ", " << b;
        }
        ++covered[static_cast<std::size_t>(b) * mask.width + a];
      }
    }
  }
  for (std::size_t i = 0; i < covered.size(); ++i) {
    if (covered[i] != (mask.cells[i] ? 1 : 0)) {
      return ::testing::AssertionFailure()
             << "cell " << i << " is covered " << covered[i] << " times";
    }
  }
  return ::testing::AssertionSuccess();
}

/// The exact minimum by search over all partitions: the first cell left in reading order is the
/// first corner of its rectangle. Nothing in common with the code under test.
class ExactMinimum {
 public:
  ExactMinimum(int width, int height) : width_(width), height_(height) {}

  int operator()(std::uint64_t bits) {
    if (bits == 0) return 0;
    const auto known = memory_.find(bits);
    if (known != memory_.end()) return known->second;
    const int first = __builtin_ctzll(bits);
    const int x = first % width_;
    const int y = first / width_;
    int best = width_ * height_;
    int widest = width_ - x;
    for (int h = 1; y + h <= height_ && widest > 0; ++h) {
      int w = 0;
      while (w < widest && ((bits >> (first + (h - 1) * width_ + w)) & 1u)) ++w;
      widest = w;
      for (w = 1; w <= widest; ++w) {
        std::uint64_t rectangle = 0;
        for (int row = 0; row < h; ++row) {
          rectangle |= ((std::uint64_t{1} << w) - 1) << (first + row * width_);
        }
        best = std::min(best, 1 + (*this)(bits & ~rectangle));
      }
    }
    memory_[bits] = best;
    return best;
  }

 private:
  int width_;
  int height_;
  std::unordered_map<std::uint64_t, int> memory_;
};

int countOf(const CellMask& mask) {
  return static_cast<int>(minimumRectanglePartition(mask).size());
}

TEST(RectanglePartition, EmptyMaskGivesNothing) {
  EXPECT_TRUE(minimumRectanglePartition(CellMask()).empty());
  EXPECT_TRUE(minimumRectanglePartition(maskOf({"...", "..."})).empty());
}

TEST(RectanglePartition, RectangleStaysWholeAndCarriesTheWindowsOffset) {
  CellMask mask = maskOf({"###", "###"});
  mask.a0 = -7;
  mask.b0 = 5;
  const std::vector<CellRectangle> rectangles = minimumRectanglePartition(mask);
  ASSERT_EQ(rectangles.size(), 1u);
  EXPECT_EQ(rectangles[0], (CellRectangle{-7, 5, 3, 2}));
}

TEST(RectanglePartition, HandWorkedShapes) {
  EXPECT_EQ(countOf(maskOf({"#.", "##"})), 2);           // L
  EXPECT_EQ(countOf(maskOf({".#.", "###", ".#."})), 3);  // plus: one chord of four
  EXPECT_EQ(countOf(maskOf({"###", "#.#", "###"})), 4);  // ring
  EXPECT_EQ(countOf(maskOf({"#.", ".#"})), 2);           // corner contact
  EXPECT_EQ(countOf(maskOf({"##..", "##..", "..##", "..##"})), 2);
  EXPECT_EQ(countOf(maskOf({"#####", "#.#.#", "#####"})), 5);  // two holes side by side
  EXPECT_EQ(countOf(maskOf({"#.#.#", "#####"})), 4);           // comb
  EXPECT_EQ(countOf(maskOf({"####", "#..#", "#..#", "####"})), 4);
}

TEST(RectanglePartition, PrefersTheDirectionWithMoreChords) {
  // Cutting along u alone gives five strips, along v alone three.
  EXPECT_EQ(countOf(maskOf({".#.", "###", ".#.", "###", ".#."})), 5);
  EXPECT_EQ(countOf(maskOf({"#.#", "###", "###", "#.#"})), 3);
}

TEST(RectanglePartition, IsMinimalForEveryRasterUpToFourByFour) {
  for (int height = 1; height <= 4; ++height) {
    for (int width = 1; width <= 4; ++width) {
      ExactMinimum exact(width, height);
      for (std::uint64_t bits = 0; bits < (std::uint64_t{1} << (width * height)); ++bits) {
        const CellMask mask = maskOf(bits, width, height);
        const std::vector<CellRectangle> rectangles = minimumRectanglePartition(mask);
        ASSERT_TRUE(coversExactly(mask, rectangles)) << width << " x " << height << ": " << bits;
        ASSERT_EQ(static_cast<int>(rectangles.size()), exact(bits))
            << width << " x " << height << ": " << bits;
      }
    }
  }
}

TEST(RectanglePartition, IsMinimalForRandomRastersUpToSixBySix) {
  Random random(7);
  const std::array<std::array<int, 2>, 4> sizes = {{{5, 5}, {5, 6}, {6, 5}, {6, 6}}};
  for (const auto& [width, height] : sizes) {
    for (int run = 0; run < 600; ++run) {
      ExactMinimum exact(width, height);
      const double density = 0.45 + 0.1 * (run % 6);
      std::uint64_t bits = 0;
      for (int i = 0; i < width * height; ++i) {
        if (random.uniform() < density) bits |= std::uint64_t{1} << i;
      }
      const CellMask mask = maskOf(bits, width, height);
      const std::vector<CellRectangle> rectangles = minimumRectanglePartition(mask);
      ASSERT_TRUE(coversExactly(mask, rectangles)) << bits;
      ASSERT_EQ(static_cast<int>(rectangles.size()), exact(bits))
          << width << " x " << height << ": " << bits;
    }
  }
}

TEST(RectanglePartition, CountSurvivesTransposeAndMirror) {
  Random random(11);
  for (int run = 0; run < 60; ++run) {
    const CellMask mask = randomMask(random, 37, 23, 0.3 + 0.01 * run);
    CellMask transposed = mask;
    CellMask mirrored = mask;
    std::swap(transposed.width, transposed.height);
    for (std::int32_t b = 0; b < mask.height; ++b) {
      for (std::int32_t a = 0; a < mask.width; ++a) {
        const std::uint8_t cell = mask.cells[static_cast<std::size_t>(b) * mask.width + a];
        transposed.cells[static_cast<std::size_t>(a) * mask.height + b] = cell;
        mirrored.cells[static_cast<std::size_t>(b) * mask.width + (mask.width - 1 - a)] = cell;
      }
    }
    const std::vector<CellRectangle> rectangles = minimumRectanglePartition(mask);
    ASSERT_TRUE(coversExactly(mask, rectangles));
    EXPECT_EQ(countOf(transposed), static_cast<int>(rectangles.size()));
    EXPECT_EQ(countOf(mirrored), static_cast<int>(rectangles.size()));
    EXPECT_TRUE(std::is_sorted(
        rectangles.begin(), rectangles.end(),
        [](const auto& l, const auto& r) { return l.b != r.b ? l.b < r.b : l.a < r.a; }));
  }
}

TEST(RectanglePartition, MaskWhoseSizeDisagreesIsAnInputError) {
  CellMask mask = maskOf({"##", "##"});
  mask.width = 3;
  EXPECT_THROW(minimumRectanglePartition(mask), InputError);
  mask.width = -2;
  mask.height = -2;
  EXPECT_THROW(minimumRectanglePartition(mask), InputError);
}

/// Seconds for one call.
double secondsFor(const CellMask& mask) {
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(coversExactly(mask, minimumRectanglePartition(mask)));
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

TEST(RectanglePartition, AdversarialMillionCellRastersStayFast) {
  constexpr std::int32_t n = 1000;
  CellMask checkerboard, comb, grid, cross, noise;
  for (CellMask* mask : {&checkerboard, &comb, &grid, &cross, &noise}) {
    mask->width = mask->height = n;
    mask->cells.resize(std::size_t{n} * n);
  }
  Random random(3);
  for (std::int32_t b = 0; b < n; ++b) {
    for (std::int32_t a = 0; a < n; ++a) {
      const std::size_t i = static_cast<std::size_t>(b) * n + a;
      checkerboard.cells[i] = (a + b) % 2;
      comb.cells[i] = b < 500 || a % 2 == 0;
      grid.cells[i] = a % 2 == 0 || b % 2 == 0;   // a hole in every other cell of every other row
      cross.cells[i] = a % 3 != 0 || b % 3 != 0;  // chords of both directions cross everywhere
      noise.cells[i] = random.uniform() < 0.7;
    }
  }
  // Generous for a loaded machine and sanitizers; quadratic growth would take hours.
  EXPECT_LT(secondsFor(checkerboard), 5.0);
  EXPECT_LT(secondsFor(comb), 5.0);
  EXPECT_LT(secondsFor(grid), 5.0);
  EXPECT_LT(secondsFor(cross), 5.0);
  EXPECT_LT(secondsFor(noise), 5.0);
}

}  // namespace
}  // namespace planar_mapping
