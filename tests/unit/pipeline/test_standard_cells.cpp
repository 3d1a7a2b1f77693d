// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "standard_cells.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

#include "planar_mapping/core/random.h"

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

TEST(StandardCells, FarPointsAreNoTrouble) {
  StandardCells cells(0.1);
  cells.add({1e12, -1e12, 3.0});
  cells.add({1e12, -1e12, 3.0});
  EXPECT_EQ(1u, cells.size());
}

}  // namespace
}  // namespace planar_mapping::detail
