// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "advice/leaning_floor.h"

#include <gtest/gtest.h>

#include "map_scene.h"

namespace planar_mapping::detail {
namespace {

constexpr double kDegree = M_PI / 180.0;

/// What two cameras in a room see, in a world turned by \p tilt.
PlanarMap roomTiltedBy(double tilt) {
  PlanarMap map;
  for (const double yaw : {0.0, 0.5}) {
    test::View view = test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, yaw, 0.5));
    view.pose = Eigen::AngleAxisd(tilt, Vector3(1.0, 0.3, 0.0).normalized()) * view.pose;
    map.insert(view.frame());
  }
  return map;
}

TEST(LeaningFloor, IsFoundWithItsTiltAndArea) {
  for (const double degrees : {8.0, 22.0, -30.0}) {
    const std::optional<LeaningFloor> floor = leaningFloor(roomTiltedBy(degrees * kDegree));
    ASSERT_TRUE(floor) << degrees;
    EXPECT_NEAR(floor->tilt, std::abs(degrees) * kDegree, 0.5 * kDegree);
    EXPECT_GT(floor->area, 4.0);
    EXPECT_LT(floor->area, 24.0);
  }
}

TEST(LeaningFloor, IsNoneInALevelRoomNorInAnEmptyMap) {
  EXPECT_FALSE(leaningFloor(roomTiltedBy(0.0)));
  EXPECT_FALSE(leaningFloor(roomTiltedBy(3.0 * kDegree)));
  EXPECT_FALSE(leaningFloor(PlanarMap()));
}

TEST(LeaningFloor, CeilingsThatLeanAreNone) {
  PlanarMap map;
  test::View view = test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.0, -0.9));
  view.pose = Eigen::AngleAxisd(20.0 * kDegree, Vector3::UnitX()) * view.pose;
  map.insert(view.frame());
  ASSERT_FALSE(map.planes().empty());
  EXPECT_FALSE(leaningFloor(map));
}

}  // namespace
}  // namespace planar_mapping::detail
