// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The index names all that a search through the list would find.
#include "planar_mapping/map/cuboids/detail/cuboid_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "planar_mapping/core/base/detail/random.h"

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
    for (std::uint32_t c = 0; c < cuboids.size(); ++c) {
      EXPECT_TRUE(has(visited, c) || !contains(cuboids[c], point, 0.2)) << c;
    }
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
      for (int step = 0; step <= 60; ++step) {
        met |= contains(cuboids[c], origin + 0.1 * step * direction);
      }
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

}  // namespace
}  // namespace planar_mapping::detail
