// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What must not change the cuboids of a scene, or must change them with it.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "evaluation/metrics/cuboid_geometry.h"
#include "patch_scene.h"

namespace planar_mapping {
namespace {

using namespace test;
using Scene = test::PatchScene;

TEST(CuboidApproximation, PlanarCuboidsMoveWithTheSensor) {
  const Scene scene = room();
  test::PatchView view;
  view.T_world_sensor.linear() =
      (Eigen::AngleAxisd(0.7, Vector3::UnitZ()) * Eigen::AngleAxisd(-0.4, Vector3::UnitX()))
          .toRotationMatrix();
  view.T_world_sensor.translation() = Vector3(4, -2, 1);
  const Pose& T = view.T_world_sensor;
  PlanarMapParams params = paramsFor(Profile::Paper);
  const std::vector<Cuboid> before = cuboidsOf(scene, params);
  params.approximation.up = T.linear() * params.approximation.up;
  const std::vector<Cuboid> after = cuboidsOf(scene, params, view);
  const auto planar = [](const Cuboid& c) { return c.plane_id >= 0; };
  const auto count = std::count_if(before.begin(), before.end(), planar);
  ASSERT_EQ(count, std::count_if(after.begin(), after.end(), planar));
  ASSERT_EQ(count, 3);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const Cuboid expected = test::transformed(before[i], T);
    // A map keeps planes to a tenth of a millimetre along each axis, at either end.
    EXPECT_NEAR((expected.center - after[i].center).norm(), 0.0, 5e-4);
    EXPECT_TRUE(expected.size.isApprox(after[i].size, 1e-9));
    EXPECT_NEAR(expected.orientation.angularDistance(after[i].orientation), 0.0, 1e-4);
  }
}

TEST(CuboidApproximation, OrderOfThePointsDoesNotMatter) {
  const Scene scene = room();
  const std::size_t count = scene.view().size;
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  Random random(3);
  for (std::size_t i = count - 1; i > 0; --i)
    std::swap(order[i], order[random.below(static_cast<std::uint32_t>(i + 1))]);
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
    const auto l = cuboidsOf(scene, paramsFor(profile));
    const auto r = cuboidsOf(shuffled, paramsFor(profile));
    ASSERT_EQ(l.size(), r.size());
    for (std::size_t i = 0; i < l.size(); ++i)
      EXPECT_NEAR((l[i].center - r[i].center).norm(), 0.0, 1e-6);
  }
}

TEST(CuboidApproximation, OrderOfThePlanesChangesTheirIdsAlone) {
  const Scene scene = room();
  Scene permuted = scene;
  std::rotate(permuted.planes.begin(), permuted.planes.begin() + 1, permuted.planes.end());
  const auto l = cuboidsOf(scene, paramsFor(Profile::Paper));
  auto r = cuboidsOf(permuted, paramsFor(Profile::Paper));
  for (Cuboid& c : r) {
    if (c.plane_id >= 0) c.plane_id = (c.plane_id + 1) % 3;
  }
  std::stable_sort(r.begin(), r.end(), [](const Cuboid& a, const Cuboid& b) {
    return static_cast<std::uint32_t>(a.plane_id) < static_cast<std::uint32_t>(b.plane_id);
  });
  ASSERT_EQ(l.size(), r.size());
  for (std::size_t i = 0; i < l.size(); ++i) {
    EXPECT_TRUE(l[i].center == r[i].center && l[i].size == r[i].size);
    EXPECT_EQ(l[i].plane_id, r[i].plane_id);
  }
}

}  // namespace
}  // namespace planar_mapping
