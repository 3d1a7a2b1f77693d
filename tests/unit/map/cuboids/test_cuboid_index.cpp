// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The index names all that a search through the list would find.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "box_scene.h"
#include "evaluation/metrics/cuboid_geometry.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/cuboids/cuboid_index.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::detail {
namespace {

Vector3 anyPlace(Random& random) {
  return {random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0)};
}

std::vector<Cuboid> anyCuboids(Random& random, std::size_t count) {
  std::vector<Cuboid> cuboids(count);
  for (Cuboid& cuboid : cuboids) {
    cuboid.center = anyPlace(random);
    cuboid.size = {random.uniform(0.1, 4.0), random.uniform(0.1, 4.0), random.uniform(0.1, 4.0)};
    const Vector3 axis = anyPlace(random).normalized();
    cuboid.orientation = Quaternion(Eigen::AngleAxisd(random.uniform(0.0, 3.0), axis));
  }
  return cuboids;
}

bool has(const std::vector<std::uint32_t>& visited, std::uint32_t cuboid) {
  return std::count(visited.begin(), visited.end(), cuboid) == 1;
}

class CuboidIndexOf : public testing::TestWithParam<std::size_t> {};

TEST_P(CuboidIndexOf, NamesEveryCuboidAtAPoint) {
  Random random(GetParam());
  const std::vector<Cuboid> cuboids = anyCuboids(random, GetParam());
  CuboidIndex index;
  index.build(cuboids);
  const CuboidIndex copy(index);
  for (int i = 0; i < 300; ++i) {
    const Vector3 point = anyPlace(random);
    std::vector<std::uint32_t> visited;
    copy.visit(point, 0.2, [&](std::uint32_t c) {
      visited.push_back(c);
      return true;
    });
    for (std::uint32_t c = 0; c < cuboids.size(); ++c)
      EXPECT_TRUE(has(visited, c) || !contains(cuboids[c], point, 0.2)) << c;
  }
}

TEST_P(CuboidIndexOf, NamesWhatLiesAlongARay) {
  Random random(GetParam() + 100);
  const std::vector<Cuboid> cuboids = anyCuboids(random, GetParam());
  CuboidIndex index;
  index.build(cuboids);
  for (int i = 0; i < 300; ++i) {
    const Vector3 origin = anyPlace(random);
    const Vector3 direction = (anyPlace(random) - origin).normalized();
    std::vector<std::uint32_t> visited;
    index.visitAlong(origin, direction, 6.0, [&](std::uint32_t c) { visited.push_back(c); });
    for (std::uint32_t c = 0; c < cuboids.size(); ++c) {
      bool met = false;
      for (int step = 0; step <= 60; ++step)
        met |= contains(cuboids[c], origin + 0.1 * step * direction);
      EXPECT_TRUE(has(visited, c) || !met) << c;
    }
  }
}

TEST_P(CuboidIndexOf, StopsWhenItIsToldTo) {
  const std::vector<Cuboid> cuboids(GetParam());
  CuboidIndex index;
  index.build(cuboids);
  std::size_t visits = 0;
  index.visit(Vector3::Zero(), 1.0, [&](std::uint32_t) {
    ++visits;
    return visits < 2;
  });
  EXPECT_EQ(visits, std::min<std::size_t>(cuboids.size(), 2));
}

INSTANTIATE_TEST_SUITE_P(AnyNumber, CuboidIndexOf, testing::Values(0, 1, 4, 5, 300));

// Boxes are not cut where regions of the map, 64 cells wide, meet; whoever asked for them before.

constexpr double kCell = 0.1;

using test::numbersOf;

/// Points all through a box, in the middles of eighths of cells.
std::vector<float> block(const Vector3& low, const Vector3& high) {
  std::vector<float> xyz;
  const double step = 0.5 * kCell;
  for (double z = low.z() + 0.5 * step; z < high.z(); z += step) {
    for (double y = low.y() + 0.5 * step; y < high.y(); y += step) {
      for (double x = low.x() + 0.5 * step; x < high.x(); x += step) {
        for (const double v : {x, y, z}) xyz.push_back(static_cast<float>(v));
      }
    }
  }
  return xyz;
}

enum class Asked : std::uint8_t { Never, Always, InTurn };

PlanarMap grown(std::uint64_t seed, Asked asked, int threads) {
  PlanarMapParams params = test::keepAll(kCell);
  params.approximation.threads = threads;
  PlanarMap map(params);
  Random random(seed);
  for (int frame = 0; frame < 6; ++frame) {
    const auto kind = static_cast<test::BoxKind>(random.below(2));
    test::insertPoints(map, test::boxScene(random, kind, 4, kCell, 180.0));
    const bool in_turn = asked == Asked::InTurn && frame % 3 != 0;
    if (asked == Asked::Always || in_turn) {
      EXPECT_EQ(map.cuboidCount(), map.cuboids().size());
    }
  }
  return map;
}

TEST(RegionBoxes, DependOnTheCellsAlone) {
  for (const std::uint64_t seed : {1u, 2u}) {
    const PlanarMap map = grown(seed, Asked::Never, 1);
    const std::vector<double> never = numbersOf(map.cuboids());
    ASSERT_GT(never.size(), 20u * 12u);
    EXPECT_EQ(numbersOf(grown(seed, Asked::Always, 2).cuboids()), never);
    EXPECT_EQ(numbersOf(grown(seed, Asked::InTurn, 2).cuboids()), never);
    const std::vector<std::uint8_t> bytes = map.serialize();
    const PlanarMap loaded = PlanarMap::deserialize(bytes.data(), bytes.size());
    EXPECT_EQ(numbersOf(loaded.cuboids()), never);
    EXPECT_EQ(loaded.serialize(), bytes);
  }
}

TEST(RegionBoxes, StandForEveryPoint) {
  Random random(4);
  const std::vector<float> xyz = test::boxScene(random, test::BoxKind::Shells, 30, kCell, 150.0);
  PlanarMap map(test::keepAll(kCell));
  test::insertPoints(map, xyz);
  std::size_t missed = 0;
  for (std::size_t i = 0; i < xyz.size(); i += 3 * 17)
    missed += map.cuboidsAt({xyz[i], xyz[i + 1], xyz[i + 2]}, 0.5 * kCell + 1e-6).empty() ? 1 : 0;
  EXPECT_EQ(missed, 0u);
  EXPECT_GT(map.cuboids().size(), 0u);
}

}  // namespace
}  // namespace planar_mapping::detail
