// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/compact_cover.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "evaluation/metrics/cuboid_geometry.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping {
namespace {

using test::paramsWith;

CellMask randomMask(std::uint64_t seed, int width, int height, double fraction) {
  Random random(seed);
  CellMask mask;
  mask.width = width;
  mask.height = height;
  mask.a0 = -3;
  mask.b0 = 5;
  for (int i = 0; i < width * height; ++i) mask.cells.push_back(random.uniform() < fraction);
  return mask;
}

/// Least number of rectangles of occupied cells that cover a mask of at most 16 cells, by trial.
class FewestRectangles {
 public:
  explicit FewestRectangles(const CellMask& mask) {
    for (std::size_t i = 0; i < mask.cells.size(); ++i) occupied_ |= unsigned{mask.cells[i]} << i;
    for (int b = 0; b < mask.height; ++b) {
      for (int a = 0; a < mask.width; ++a) {
        for (int h = 1; b + h <= mask.height; ++h) {
          for (int w = 1; a + w <= mask.width; ++w) {
            unsigned bits = 0;
            for (int y = b; y < b + h; ++y) {
              for (int x = a; x < a + w; ++x) bits |= 1u << (y * mask.width + x);
            }
            if ((bits & ~occupied_) == 0) rectangles_.push_back(bits);
          }
        }
      }
    }
  }
  std::size_t count() const {
    for (std::size_t n = 0;; ++n) {
      if (covers(0, n)) return n;
    }
  }

 private:
  bool covers(unsigned covered, std::size_t left) const {
    const unsigned open = occupied_ & ~covered;
    if (open == 0) return true;
    if (left == 0) return false;
    const unsigned first = open & (~open + 1);
    return std::any_of(rectangles_.begin(), rectangles_.end(), [&](unsigned bits) {
      return (bits & first) != 0 && covers(covered | bits, left - 1);
    });
  }
  unsigned occupied_ = 0;
  std::vector<unsigned> rectangles_;
};

/// Probability of the cells of a mask of which none was left out.
std::vector<float> certain(const CellMask& mask) {
  return std::vector<float>(mask.cells.size(), 1.0f);
}

/// Middle of half cell (a, b) within so many half cells of the rectangle, along both axes.
bool reaches(const HalfCellRectangle& r, int a, int b, double beyond) {
  return a + 0.5 >= r.a - beyond && a + 0.5 <= r.a + r.width + beyond && b + 0.5 >= r.b - beyond &&
         b + 0.5 <= r.b + r.height + beyond;
}

TEST(CoverSurface, IsAlmostTheMinimumCoverOfSmallRasters) {
  std::size_t found = 0, fewest = 0;
  for (std::uint64_t seed = 1; seed <= 120; ++seed) {
    const CellMask mask = randomMask(seed, 4, 4, 0.4 + 0.1 * static_cast<double>(seed % 6));
    CuboidApproximationParams params = paramsWith(0.0);
    params.hole_size = 0.01;  // none is filled
    const SurfaceCover cover = coverSurface(mask, certain(mask), params);
    EXPECT_TRUE(cover.loose.empty());
    const std::size_t least = FewestRectangles(mask).count();
    EXPECT_GE(cover.rectangles.size(), least);
    EXPECT_LE(cover.rectangles.size(), least + 1);
    found += cover.rectangles.size();
    fewest += least;
  }
  EXPECT_LE(static_cast<double>(found), 1.03 * static_cast<double>(fewest));
}

TEST(CoverSurface, StandsForAllAndStaysWithinHalfACell) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const CellMask mask = randomMask(seed, 12, 9, 0.5 + 0.01 * static_cast<double>(seed));
    CuboidApproximationParams params = paramsWith(0.5, seed % 2 == 0 ? 0.0 : 3.0);
    const SurfaceCover cover = coverSurface(mask, certain(mask), params);
    const auto isLoose = [&](int a, int b) {
      return std::any_of(cover.loose.begin(), cover.loose.end(),
                         [&](const LooseQuarter& q) { return q.a == a && q.b == b; });
    };
    for (int b = 0; b < mask.height; ++b) {
      for (int a = 0; a < mask.width; ++a) {
        for (int q = 0; q < 4 && mask.at(a, b); ++q) {
          const int x = 2 * (a + mask.a0) + (q & 1);
          const int y = 2 * (b + mask.b0) + (q >> 1);
          EXPECT_TRUE(isLoose(x, y) ||
                      std::any_of(cover.rectangles.begin(), cover.rectangles.end(),
                                  [&](const auto& r) { return reaches(r, x, y, 0.5 + 1e-9); }));
        }
      }
    }
    for (const HalfCellRectangle& r : cover.rectangles) {
      EXPECT_GE(std::min(r.width, r.height), 2);
      for (int y = r.b; y < r.b + r.height; ++y) {
        for (int x = r.a; x < r.a + r.width; ++x) {
          bool near = false;  // an occupied cell, or a hole of one
          for (int dy = -1; dy <= 1; ++dy) {
            for (int dx = -1; dx <= 1; ++dx) {
              const int a = ((x + dx) >> 1) - mask.a0;
              const int b = ((y + dy) >> 1) - mask.b0;
              near |= mask.at(a, b) || (mask.at(a - 1, b) && mask.at(a + 1, b) &&
                                        mask.at(a, b - 1) && mask.at(a, b + 1));
            }
          }
          EXPECT_TRUE(near);
        }
      }
    }
    EXPECT_EQ(cover.rectangles.size(), cover.probability.size());
    if (params.rectangle_cells == 0.0) {
      EXPECT_LE(cover.rectangles.size(),
                coverSurface(mask, certain(mask), paramsWith(0.0)).rectangles.size());
    }
  }
}

TEST(CoverSurface, WallWithSmallHolesIsOneRectangle) {
  // 20 x 10 cells with holes of one cell.
  CellMask mask;
  mask.width = 20;
  mask.height = 10;
  mask.cells.assign(200, 1);
  for (const std::size_t hole : {45u, 67u, 133u}) mask.cells[hole] = 0;
  const SurfaceCover cover = coverSurface(mask, certain(mask), paramsWith(0.5, 4.0));
  EXPECT_EQ(cover.rectangles.size(), 1u);
  EXPECT_TRUE(cover.loose.empty());
}

TEST(CoverSurface, RefusesWhatDoesNotFit) {
  CellMask mask = randomMask(1, 3, 3, 1.0);
  EXPECT_THROW(coverSurface(mask, {1.0f}, paramsWith(0.5)), InputError);
  mask.cells.pop_back();
  EXPECT_THROW(coverSurface(mask, certain(mask), paramsWith(0.5)), InputError);
  EXPECT_TRUE(coverSurface(CellMask(), {}, paramsWith(0.5)).rectangles.empty());
  EXPECT_THROW(coverSurface(CellMask(), {}, paramsWith(0.7)), ParameterError);
  EXPECT_THROW(coverSurface(CellMask(), {}, paramsWith(0.5, -1.0)), ParameterError);
}

}  // namespace
}  // namespace planar_mapping
