// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/geometry/cuboid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "planar_mapping/core/base/detail/random.h"

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

TEST(Cuboid, DistanceMatchesHandWorkedValues) {
  Cuboid cuboid;
  cuboid.size = Vector3(2, 2, 2);
  EXPECT_EQ(distance(cuboid, {0.5, 0.5, 0.5}), 0.0);
  EXPECT_DOUBLE_EQ(distance(cuboid, {3, 0, 0}), 2.0);
  EXPECT_DOUBLE_EQ(distance(cuboid, {4, 5, 1}), 5.0);
}

TEST(Cuboid, DistanceAgreesWithDenseSampling) {
  const Cuboid cuboid = tilted();
  Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    const Vector3 p(random.uniform(-2, 4), random.uniform(-5, 1), random.uniform(0, 6));
    double nearest = 1e9;
    for (int i = 0; i <= 40; ++i) {
      for (int j = 0; j <= 24; ++j) {
        for (int k = 0; k <= 4; ++k) {
          const Vector3 local((i / 40.0 - 0.5) * 2.0, (j / 24.0 - 0.5) * 0.6,
                              (k / 4.0 - 0.5) * 0.1);
          const Vector3 sample = cuboid.center + cuboid.orientation.toRotationMatrix() * local;
          nearest = std::min(nearest, (sample - p).norm());
        }
      }
    }
    EXPECT_LE(distance(cuboid, p), nearest + 1e-9);
    EXPECT_GE(distance(cuboid, p), nearest - 0.04);
  }
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

TEST(Cuboid, MovesRigidly) {
  const Cuboid cuboid = tilted();
  Pose T = Pose::Identity();
  T.linear() = Quaternion(0.5, -0.5, 0.1, 0.7).normalized().toRotationMatrix();
  T.translation() = Vector3(5, 6, 7);
  const Cuboid moved = transformed(cuboid, T);
  const auto before = corners(cuboid);
  const auto after = corners(moved);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_NEAR((T * before[i] - after[i]).norm(), 0.0, 1e-12);
  EXPECT_NEAR(moved.volume(), cuboid.volume(), 1e-12);
}

TEST(Cuboid, StatesHaveNames) {
  EXPECT_EQ(toString(CellState::Free), std::string("free"));
  EXPECT_EQ(toString(CellState::Occupied), std::string("occupied"));
  EXPECT_EQ(toString(CellState::Unknown), std::string("unknown"));
}

}  // namespace
}  // namespace planar_mapping
