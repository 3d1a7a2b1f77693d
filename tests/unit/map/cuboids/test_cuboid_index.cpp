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

TEST(JoinedBoxes, ABoxOverManyRegionsIsOne) {
  PlanarMap map(test::keepAll(kCell));
  test::insertPoints(map, block({-9.0, -8.0, -4.0}, {11.0, -7.8, 5.0}));
  ASSERT_EQ(map.cuboids().size(), 1u);
  EXPECT_TRUE(map.cuboids().front().center.isApprox(Vector3(1.0, -7.9, 0.5)));
  EXPECT_TRUE(map.cuboids().front().size.isApprox(Vector3(20.0, 0.2, 9.0)));
  EXPECT_GT(map.cuboidCountAtMost(), 0u);
  EXPECT_TRUE(map.isOccupied({-3.2, -7.9, 3.2}));
  EXPECT_FALSE(map.isOccupied({-3.2, -7.6, 3.2}));
}

TEST(JoinedBoxes, GrowWithTheMap) {
  PlanarMap map(test::keepAll(kCell));
  test::insertPoints(map, block({-5.0, 2.0, 0.0}, {5.0, 2.2, 0.2}));
  EXPECT_EQ(map.cuboids().size(), 1u);
  test::insertPoints(map, block({5.0, 2.0, 0.0}, {12.0, 2.2, 0.2}));
  EXPECT_EQ(map.cuboids().size(), 1u);
  // Near two of the three regions only; the other one's fraction of the box is known from before.
  test::insertPoints(map, block({-4.0, 2.0, 0.2}, {-2.0, 2.2, 1.0}));
  EXPECT_EQ(map.cuboids().size(), 2u);
  const PlanarMap fresh = map;  // has derived nothing yet
  EXPECT_EQ(numbersOf(fresh.cuboids()), numbersOf(map.cuboids()));
}

enum class Asked : std::uint8_t { Never, Quickly, Fully, InTurn };

PlanarMap grown(std::uint64_t seed, Asked asked, int threads) {
  PlanarMapParams params = test::keepAll(kCell);
  params.approximation.threads = threads;
  PlanarMap map(params);
  Random random(seed);
  for (int frame = 0; frame < 6; ++frame) {
    const auto kind = static_cast<test::BoxKind>(random.below(2));
    test::insertPoints(map, test::boxScene(random, kind, 4, kCell, 180.0));
    const bool in_turn = asked == Asked::InTurn && frame % 3 != 0;
    if (asked == Asked::Quickly || in_turn) {
      EXPECT_GE(map.cuboidCountAtMost(), PlanarMap(map).cuboidCount());
    }
    if (asked == Asked::Fully || (in_turn && frame % 3 == 1)) {
      EXPECT_EQ(map.cuboidCount(), map.cuboids().size());
    }
  }
  return map;
}

TEST(JoinedBoxes, DependOnTheCellsAlone) {
  for (const std::uint64_t seed : {1u, 2u}) {
    const PlanarMap map = grown(seed, Asked::Never, 1);
    const std::vector<double> never = numbersOf(map.cuboids());
    ASSERT_GT(never.size(), 20u * 12u);
    EXPECT_EQ(numbersOf(grown(seed, Asked::Quickly, 2).cuboids()), never);
    EXPECT_EQ(numbersOf(grown(seed, Asked::Fully, 1).cuboids()), never);
    EXPECT_EQ(numbersOf(grown(seed, Asked::InTurn, 2).cuboids()), never);
    const std::vector<std::uint8_t> bytes = map.serialize();
    const PlanarMap loaded = PlanarMap::deserialize(bytes.data(), bytes.size());
    EXPECT_EQ(numbersOf(loaded.cuboids()), never);
    EXPECT_EQ(loaded.serialize(), bytes);
  }
}

TEST(JoinedBoxes, OfPartsTooWideForOneGridMeetAtFaces) {
  // Three bars of 500 cells that meet at a corner; each crosses eight borders.
  std::vector<float> xyz;
  for (int k = 0; k < 3; ++k) {
    Vector3 high = Vector3::Constant(2.0 * kCell);
    high[k] = 500.0 * kCell;
    const std::vector<float> bar = block(Vector3::Zero(), high);
    xyz.insert(xyz.end(), bar.begin(), bar.end());
  }
  PlanarMap map(test::keepAll(kCell));
  test::insertPoints(map, xyz);
  const std::size_t cut = map.cuboidCountAtMost();
  EXPECT_GE(cut, 3u * 8u);
  EXPECT_LE(map.cuboids().size(), cut * 2 / 3);
  for (std::size_t i = 0; i < xyz.size(); i += 3 * 17)
    ASSERT_FALSE(map.cuboidsAt({xyz[i], xyz[i + 1], xyz[i + 2]}, 0.5 * kCell + 1e-6).empty());
  // At another end something is added: the rest stays joined as it would be anew.
  test::insertPoints(map, block({49.0, 0.3, 0.0}, {49.4, 1.0, 0.2}));
  EXPECT_EQ(numbersOf(map.cuboids()), numbersOf(PlanarMap(map).cuboids()));
}

TEST(JoinedBoxes, StandForEveryPoint) {
  Random random(4);
  const std::vector<float> xyz = test::boxScene(random, test::BoxKind::Shells, 30, kCell, 150.0);
  PlanarMap map(test::keepAll(kCell));
  test::insertPoints(map, xyz);
  const std::vector<Cuboid>& cuboids = map.cuboids();
  std::size_t missed = 0, wide = 0;
  for (std::size_t i = 0; i < xyz.size(); i += 3 * 17)
    missed += map.cuboidsAt({xyz[i], xyz[i + 1], xyz[i + 2]}, 0.5 * kCell + 1e-6).empty() ? 1 : 0;
  for (const Cuboid& c : cuboids) {
    // The frame's sensor, at the origin, is in the middle of a region.
    const double border = 32 * kCell;
    for (const double at : {-3.0 * border, -border, border, 3.0 * border})
      wide += std::abs(c.center.x() - at) < 0.5 * c.size.x() - 1e-6 ? 1 : 0;
  }
  EXPECT_EQ(missed, 0u);
  EXPECT_GT(wide, 0u);
}

}  // namespace
}  // namespace planar_mapping::detail
