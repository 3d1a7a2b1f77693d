// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/geometry/cuboid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace planar_mapping {
namespace {

Cuboid tilted() {
  Cuboid cuboid;
  cuboid.center = Vector3(1, -2, 3);
  cuboid.orientation = Quaternion(0.8, 0.2, -0.3, 0.4).normalized();
  cuboid.size = Vector3(2.0, 0.6, 0.1);
  return cuboid;
}

TEST(Cuboid, ContainsItsCornersAndNothingBeyond) {
  const Cuboid cuboid = tilted();
  for (const Vector3& corner : corners(cuboid)) {
    EXPECT_TRUE(contains(cuboid, corner, 1e-9));
    EXPECT_FALSE(contains(cuboid, corner + 0.01 * (corner - cuboid.center).normalized()));
  }
  EXPECT_TRUE(contains(cuboid, cuboid.center));
  EXPECT_FALSE(contains(cuboid, Vector3(NAN, 0, 0)));
}

TEST(Cuboid, MarginWidensItOnAllSides) {
  Cuboid cuboid;
  cuboid.size = Vector3(2, 2, 2);
  EXPECT_FALSE(contains(cuboid, {1.05, 0, 0}));
  EXPECT_TRUE(contains(cuboid, {1.05, -1.05, 1.05}, 0.1));
}

TEST(Cuboid, CornerBitsChooseTheSigns) {
  Cuboid cuboid;
  cuboid.size = Vector3(2, 4, 6);
  const auto c = corners(cuboid);
  EXPECT_EQ(c[0], Vector3(-1, -2, -3));
  EXPECT_EQ(c[1], Vector3(1, -2, -3));
  EXPECT_EQ(c[2], Vector3(-1, 2, -3));
  EXPECT_EQ(c[4], Vector3(-1, -2, 3));
  EXPECT_EQ(c[7], Vector3(1, 2, 3));
}

TEST(Cuboid, StatesHaveNames) {
  EXPECT_EQ(toString(CellState::Free), std::string("free"));
  EXPECT_EQ(toString(CellState::Occupied), std::string("occupied"));
  EXPECT_EQ(toString(CellState::Unknown), std::string("unknown"));
}

}  // namespace
}  // namespace planar_mapping
