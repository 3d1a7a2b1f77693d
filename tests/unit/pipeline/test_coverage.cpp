// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "coverage.h"

#include <gtest/gtest.h>

#include "planar_mapping/core/random.h"

namespace planar_mapping::detail {
namespace {

TEST(Coverage, AgreesWithTheDistanceToEveryCuboid) {
  Random random(5);
  std::vector<Cuboid> cuboids(60);
  for (Cuboid& cuboid : cuboids) {
    cuboid.center = {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)};
    cuboid.size = {random.uniform(0.05, 2.0), random.uniform(0.05, 0.5), 0.1};
    cuboid.orientation =
        Quaternion(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
  }
  const double margin = 0.05;
  const CoverageIndex index(cuboids, margin, 0.2);
  int covered = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3 p(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3));
    double nearest = 1e9;
    for (const Cuboid& cuboid : cuboids) nearest = std::min(nearest, distance(cuboid, p));
    if (std::abs(nearest - margin) < 1e-9) continue;
    ASSERT_EQ(nearest < margin, index.covers(p)) << p.transpose();
    covered += nearest < margin ? 1 : 0;
  }
  EXPECT_GT(covered, 200);
}

TEST(Coverage, HugeCuboidsAreFoundWithoutEnteringEveryCell) {
  Cuboid cuboid;
  cuboid.size = {1e6, 1e6, 1e6};
  const std::vector<Cuboid> cuboids = {cuboid};
  const CoverageIndex index(cuboids, 0.05, 0.2);
  EXPECT_TRUE(index.covers({4e5, -4e5, 1.0}));
  EXPECT_FALSE(index.covers({6e5, 0.0, 0.0}));
}

TEST(Coverage, WithoutCuboidsNothingIsCovered) {
  const std::vector<Cuboid> none;
  EXPECT_FALSE(CoverageIndex(none, 0.05, 0.2).covers({0, 0, 0}));
}

}  // namespace
}  // namespace planar_mapping::detail
