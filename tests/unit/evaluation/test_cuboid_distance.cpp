// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/cuboids/cuboid_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "evaluation/metrics/cuboid_geometry.h"
#include "evaluation/metrics/map_metrics.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"

namespace planar_mapping::evaluation {
namespace {

std::vector<Cuboid> randomCuboids(std::size_t count, std::uint64_t seed, double reach = 3.0) {
  Random random(seed);
  std::vector<Cuboid> cuboids(count);
  for (Cuboid& cuboid : cuboids) {
    cuboid.center =
        reach * Vector3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    cuboid.size = {random.uniform(0.05, 2.0), random.uniform(0.05, 0.5), random.uniform(0.0, 0.1)};
    cuboid.orientation =
        Quaternion(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
  }
  return cuboids;
}

TEST(CuboidDistance, AgreesWithEveryCuboidAskedInTurn) {
  Random random(2);
  const std::vector<Cuboid> cuboids = randomCuboids(150, 5);
  const CuboidDistance index(cuboids);
  EXPECT_EQ(index.size(), 150u);
  for (int i = 0; i < 3000; ++i) {
    const Vector3 p(random.uniform(-4, 4), random.uniform(-4, 4), random.uniform(-4, 4));
    double nearest = std::numeric_limits<double>::infinity();
    for (const Cuboid& cuboid : cuboids) nearest = std::min(nearest, test::distanceTo(cuboid, p));
    ASSERT_NEAR(index.distance(p), nearest, 1e-12);
    for (const double margin : {0.0, 0.05, 0.4}) {
      if (std::abs(nearest - margin) > 1e-9 || (margin == 0.0 && nearest > 1e-9)) {
        ASSERT_EQ(index.isWithin(p, margin), nearest <= margin) << p.transpose();
      }
    }
  }
}

/// Is the point in a cuboid before number \p end? Asked with a block around it.
bool isInsideOneBefore(const CuboidDistance& index, const Vector3& point, std::size_t end,
                       const Matrix3& half_axes) {
  CuboidDistance::Overlap overlap;
  index.findBefore(end, point, half_axes, overlap);
  if (overlap.is_whole) return true;
  return std::any_of(overlap.cuboids.begin(), overlap.cuboids.end(),
                     [&](std::uint32_t cuboid) { return index.holds(cuboid, point); });
}

TEST(CuboidDistance, HintsChangeNoAnswer) {
  Random random(15);
  const CuboidDistance index(randomCuboids(80, 16));
  std::uint32_t hint = 4000000000u;
  std::uint32_t other_hint = 7;
  for (int i = 0; i < 2000; ++i) {
    const Vector3 p(random.uniform(-4, 4), random.uniform(-4, 4), random.uniform(-4, 4));
    ASSERT_EQ(index.distance(p, hint), index.distance(p));
    ASSERT_EQ(index.isWithin(p, 0.3, other_hint), index.isWithin(p, 0.3));
  }
}

TEST(CuboidDistance, NothingIsNearWithoutCuboids) {
  const CuboidDistance index({});
  EXPECT_EQ(index.distance({0, 0, 0}), std::numeric_limits<double>::infinity());
  EXPECT_FALSE(index.isWithin({0, 0, 0}, 1e9));
  EXPECT_FALSE(isInsideOneBefore(index, {0, 0, 0}, 5, Matrix3::Identity()));
}

TEST(CuboidDistance, HugeCuboidsHideNoSmallOnes) {
  Cuboid huge;
  huge.size = {1e6, 1e6, 1e6};
  Cuboid small;
  small.center = {6e5, 0, 0};
  small.size = {0.1, 0.1, 0.1};
  const CuboidDistance index({huge, small});
  EXPECT_TRUE(index.isWithin({4e5, -4e5, 1.0}, 0.05));
  EXPECT_FALSE(index.isWithin({6e5, 1.0, 0.0}, 0.05));
  EXPECT_TRUE(index.isWithin({6e5, 0.0, 0.09}, 0.05));
}

TEST(CuboidDistance, ManyCuboidsAtOnePlaceAreNoDeepTree) {
  const CuboidDistance index(std::vector<Cuboid>(20000));
  EXPECT_EQ(index.distance({3.0, 4.0, 0.0}), 5.0);
  EXPECT_FALSE(isInsideOneBefore(index, {0, 0, 0}, 0, Matrix3::Zero()));
  EXPECT_TRUE(isInsideOneBefore(index, {0, 0, 0}, 1, Matrix3::Zero()));
}

TEST(SurfaceDistanceMetric, IsThatOfWhereRaysEnter) {
  // A slab from x = 2.9 to 3.1 about a surface at 3 m, and rays that meet it at any angle.
  Cuboid slab = test::cuboidAt(Vector3(3.0, 0.0, 0.0), Vector3(0.2, 4.0, 4.0));
  const auto to_wall = [](const Vector3& point) { return std::abs(point.x() - 3.0); };
  std::vector<MeasuredRay> rays;
  for (double y = -1.9; y < 2.0; y += 0.2) rays.push_back({{0, 0, 0}, {3.0, y, 0.3}});
  const SurfaceDistance near = surfaceDistance(CuboidDistance({slab}), rays, 1, to_wall);
  EXPECT_NEAR(near.median, 0.1, 1e-3);
  EXPECT_NEAR(near.percentile_95, 0.1, 1e-3);
  // One ray of twenty meets a box half way, two miss everything.
  Cuboid box = test::cuboidAt(0.5 * rays[0].end, Vector3::Constant(0.02));
  rays[1].end = rays[2].end = Vector3(-3.0, 0.0, 0.0);
  const SurfaceDistance lost = surfaceDistance(CuboidDistance({slab, box}), rays, 1, to_wall);
  EXPECT_NEAR(lost.median, 0.1, 1e-3);
  EXPECT_EQ(lost.percentile_95, std::numeric_limits<double>::infinity());
  rays.resize(1);
  EXPECT_NEAR(surfaceDistance(CuboidDistance({slab, box}), rays, 1, to_wall).median, 1.51, 1e-3);
}

TEST(CuboidDistance, BadCuboidsAndPoints) {
  Cuboid cuboid;
  cuboid.size = {1.0, -1.0, 1.0};
  EXPECT_THROW(CuboidDistance({cuboid}), InputError);
  cuboid.size = {1.0, std::numeric_limits<double>::quiet_NaN(), 1.0};
  EXPECT_THROW(CuboidDistance({cuboid}), InputError);
  cuboid = Cuboid();
  cuboid.center.x() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(CuboidDistance({cuboid}), InputError);
  const CuboidDistance index({Cuboid()});
  EXPECT_FALSE(index.isWithin({1, 0, 0}, -1.0));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(index.isWithin({1, 0, 0}, nan));
  EXPECT_FALSE(index.isWithin({nan, 0, 0}, 1.0));
}

}  // namespace
}  // namespace planar_mapping::evaluation
