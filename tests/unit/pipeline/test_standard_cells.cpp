// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "run_statistics.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping::detail {
namespace {

TEST(StandardCells, AgreeWithASet) {
  Random random(3);
  StandardCells cells(0.1);
  std::set<std::array<int, 3>> expected;
  for (int i = 0; i < 50000; ++i) {
    const Vector3 p(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-1, 1));
    cells.add(p);
    expected.insert({static_cast<int>(std::floor(p.x() / 0.1)),
                     static_cast<int>(std::floor(p.y() / 0.1)),
                     static_cast<int>(std::floor(p.z() / 0.1))});
  }
  EXPECT_EQ(expected.size(), cells.size());
}

TEST(StandardCells, PointsBeyondTheGridAreLeftOut) {
  StandardCells cells(0.1);
  cells.add({1e12, -1e12, 3.0});
  cells.add({1e4, -1e4, 3.0});
  cells.add({1e4, -1e4, 3.0});
  EXPECT_EQ(1u, cells.size());
}

TEST(StandardCells, EachCellKeepsOneOfItsPoints) {
  StandardCells cells(1.0);
  for (int i = 0; i < 7; ++i) cells.add({0.1 * i, 0.0, 0.0});
  cells.add({5.5, 0.0, 0.0});
  std::size_t points = 0;
  cells.forEach([&](const StandardCells::Cell& cell) {
    points += cell.points;
    // Of seven points the fourth was the last to make their number a power of two.
    EXPECT_EQ(cell.point[0], cell.points == 7 ? 0.3f : 5.5f);
  });
  EXPECT_EQ(points, 8u);
}

}  // namespace
}  // namespace planar_mapping::detail
