// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What must not change the cuboids of a scene, or must change them with it.
#include "planar_mapping/core/cuboids/cuboid_approximation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <vector>

#include "patch_scene.h"
#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping {
namespace {

using test::paramsFor;
using test::room;
using Scene = test::PatchScene;

void expectSameCuboids(const std::vector<Cuboid>& l, const std::vector<Cuboid>& r) {
  ASSERT_EQ(l.size(), r.size());
  for (std::size_t i = 0; i < l.size(); ++i) {
    EXPECT_TRUE(l[i].center == r[i].center && l[i].size == r[i].size);
    EXPECT_EQ(l[i].plane_id, r[i].plane_id);
  }
}

TEST(CuboidApproximation, MovesWithTheScene) {
  const Scene scene = room();
  Pose T = Pose::Identity();
  T.linear() =
      (Eigen::AngleAxisd(0.7, Vector3::UnitZ()) * Eigen::AngleAxisd(-0.4, Vector3::UnitX()))
          .toRotationMatrix();
  T.translation() = Vector3(4, -2, 1);
  Scene moved;
  for (std::size_t i = 0; i < scene.view().size; ++i) moved.add(T * scene.view().point(i));
  moved.planes = scene.planes;
  for (PlaneSegment& segment : moved.planes) segment.plane = transformed(segment.plane, T);

  CuboidApproximationParams params = paramsFor(Profile::Compact);
  const auto before = approximateCuboids(scene.view(), nullptr, scene.planes, params);
  params.up = T.linear() * params.up;
  const auto after =
      approximateCuboids(moved.view(), nullptr, moved.planes, params, T.translation());
  std::vector<Cuboid> planar_before, planar_after;
  const auto planar = [](const Cuboid& c) { return c.plane_id >= 0; };
  std::copy_if(before.begin(), before.end(), std::back_inserter(planar_before), planar);
  std::copy_if(after.begin(), after.end(), std::back_inserter(planar_after), planar);
  ASSERT_EQ(planar_before.size(), planar_after.size());
  for (std::size_t i = 0; i < planar_before.size(); ++i) {
    const Cuboid expected = transformed(planar_before[i], T);
    EXPECT_NEAR((expected.center - planar_after[i].center).norm(), 0.0, 1e-5);
    EXPECT_TRUE(expected.size.isApprox(planar_after[i].size, 1e-9));
    EXPECT_NEAR(expected.orientation.angularDistance(planar_after[i].orientation), 0.0, 1e-6);
  }
}

TEST(CuboidApproximation, OrderOfThePointsDoesNotMatter) {
  const Scene scene = room();
  const std::size_t count = scene.view().size;
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  Random random(3);
  for (std::size_t i = count - 1; i > 0; --i) {
    std::swap(order[i], order[random.below(static_cast<std::uint32_t>(i + 1))]);
  }
  std::vector<int> place(count);
  Scene shuffled;
  for (std::size_t i = 0; i < count; ++i) {
    place[static_cast<std::size_t>(order[i])] = static_cast<int>(i);
    shuffled.add(scene.view().point(static_cast<std::size_t>(order[i])));
  }
  shuffled.planes = scene.planes;
  for (PlaneSegment& segment : shuffled.planes) {
    for (int& i : segment.inliers) i = place[static_cast<std::size_t>(i)];
    std::sort(segment.inliers.begin(), segment.inliers.end());
  }
  for (const Profile profile : {Profile::Paper, Profile::Compact}) {
    const auto l = approximateCuboids(scene.view(), nullptr, scene.planes, paramsFor(profile));
    const auto r =
        approximateCuboids(shuffled.view(), nullptr, shuffled.planes, paramsFor(profile));
    ASSERT_EQ(l.size(), r.size());
    for (std::size_t i = 0; i < l.size(); ++i) {
      EXPECT_NEAR((l[i].center - r[i].center).norm(), 0.0, 1e-6);
    }
  }
}

TEST(CuboidApproximation, PermutedPlanesOnlyPermuteTheIds) {
  const Scene scene = room();
  Scene permuted = scene;
  std::rotate(permuted.planes.begin(), permuted.planes.begin() + 1, permuted.planes.end());
  const auto l =
      approximateCuboids(scene.view(), nullptr, scene.planes, paramsFor(Profile::Compact));
  auto r =
      approximateCuboids(permuted.view(), nullptr, permuted.planes, paramsFor(Profile::Compact));
  for (Cuboid& c : r) {
    if (c.plane_id >= 0) c.plane_id = (c.plane_id + 1) % 3;
  }
  std::stable_sort(r.begin(), r.end(), [](const Cuboid& a, const Cuboid& b) {
    return static_cast<std::uint32_t>(a.plane_id) < static_cast<std::uint32_t>(b.plane_id);
  });
  expectSameCuboids(l, r);
}

TEST(CuboidApproximation, SubsetByIndexIsSubsetByCopy) {
  const Scene scene = room();
  Scene copy;
  Indices indices;
  std::vector<int> place(scene.view().size, -1);
  for (std::size_t i = 0; i < scene.view().size; i += 3) {
    indices.push_back(static_cast<int>(i));
    place[i] = copy.add(scene.view().point(i));
  }
  copy.planes = scene.planes;
  for (PlaneSegment& segment : copy.planes) {
    Indices kept;
    for (const int i : segment.inliers) {
      if (place[static_cast<std::size_t>(i)] >= 0)
        kept.push_back(place[static_cast<std::size_t>(i)]);
    }
    segment.inliers = kept;
  }
  expectSameCuboids(
      approximateCuboids(scene.view(), &indices, scene.planes, paramsFor(Profile::Compact)),
      approximateCuboids(copy.view(), nullptr, copy.planes, paramsFor(Profile::Compact)));
}

TEST(CuboidApproximation, ThreadsDoNotChangeTheResult) {
  const Scene scene = room();
  CuboidApproximationParams params = paramsFor(Profile::Compact);
  const auto one = approximateCuboids(scene.view(), nullptr, scene.planes, params);
  params.threads = 4;
  expectSameCuboids(one, approximateCuboids(scene.view(), nullptr, scene.planes, params));
}

}  // namespace
}  // namespace planar_mapping
