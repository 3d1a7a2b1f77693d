// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "advice/leaning_floor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "map_scene.h"
#include "ring_scan.h"

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
    const std::optional<LeaningFloor> floor = leaningFloor(roomTiltedBy(degrees * kDegree), true);
    ASSERT_TRUE(floor) << degrees;
    EXPECT_NEAR(floor->tilt, std::abs(degrees) * kDegree, 0.5 * kDegree);
    EXPECT_GT(floor->area, 4.0);
    EXPECT_LT(floor->area, 24.0);
  }
}

TEST(LeaningFloor, IsNoneInALevelRoomNorInAnEmptyMap) {
  EXPECT_FALSE(leaningFloor(roomTiltedBy(0.0), true));
  EXPECT_FALSE(leaningFloor(roomTiltedBy(3.0 * kDegree), true));
  EXPECT_FALSE(leaningFloor(PlanarMap(), false));
}

TEST(LeaningFloor, CeilingsThatLeanAreNone) {
  PlanarMap map;
  test::View view = test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.0, -0.9));
  view.pose = Eigen::AngleAxisd(20.0 * kDegree, Vector3::UnitX()) * view.pose;
  map.insert(view.frame());
  ASSERT_FALSE(map.planes().empty());
  EXPECT_FALSE(leaningFloor(map, true));
}

/// What a scanner 1.2 m above the floor of a room of 8 x 6 x 3 m sees, or of its floor only, by a
/// pose that turns and does not move it.
PlanarMap scanTurnedBy(double angle, bool floor_only) {
  const std::vector<float> all = test::boxScan({-4, -3, -1.2}, {4, 3, 1.8}, 60.0);
  std::vector<float> xyz;
  for (auto p = all.begin(); p != all.end(); p += 3) {
    if (!floor_only || p[2] < -1.199999f) xyz.insert(xyz.end(), p, p + 3);
  }
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), xyz.size() / 3);
  const std::vector<PlaneSegment> planes =
      findPlanes(frame.points, nullptr, MultiPlaneParams()).planes;
  frame.planes = &planes;
  frame.T_world_sensor = Pose(Eigen::AngleAxisd(angle, Vector3::UnitX()));
  PlanarMap map;
  map.insert(frame);
  return map;
}

/// Squares a metre apart that face along y, of \p area m2 together.
PlanarMap floorsAlongY(double area, int floors, bool is_merged = true) {
  std::vector<float> xyz;
  const double half = 0.5 * std::sqrt(area / floors);
  for (double x = -half; x < half; x += 0.03) {
    for (double z = -half; z < half; z += 0.03) {
      for (int y = 0; y < floors; ++y) {
        xyz.insert(xyz.end(),
                   {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
      }
    }
  }
  FrameObservation frame;
  frame.points = PointsView(xyz.data(), xyz.size() / 3);
  const std::vector<PlaneSegment> planes =
      findPlanes(frame.points, nullptr, MultiPlaneParams()).planes;
  frame.planes = &planes;
  PlanarMapParams params;
  params.unknown_space = !is_merged;
  PlanarMap map(params);
  map.insert(frame);
  return map;
}

TEST(LeaningFloor, LevelWithoutTheTurnOfThePoseIsSaid) {
  const double right_angle = 90.0 * kDegree;
  const std::optional<LeaningFloor> floor = leaningFloor(scanTurnedBy(-right_angle, true), false);
  ASSERT_TRUE(floor);
  EXPECT_EQ(LeaningFloor::Kind::LevelWithoutTurn, floor->kind);
  EXPECT_NEAR(floor->tilt, right_angle, kDegree);
  EXPECT_NEAR(floor->up.y(), 1.0, 1e-6);
  EXPECT_FALSE(leaningFloor(scanTurnedBy(-right_angle, true), true));
  EXPECT_FALSE(leaningFloor(scanTurnedBy(0.0, true), false));
  EXPECT_FALSE(leaningFloor(scanTurnedBy(0.0, false), false));
}

TEST(LeaningFloor, PlanesThatAllFaceAlongAnotherAxisAreSaid) {
  const std::optional<LeaningFloor> floors = leaningFloor(floorsAlongY(20.0, 2), false);
  ASSERT_TRUE(floors);
  EXPECT_EQ(LeaningFloor::Kind::OtherAxis, floors->kind);
  EXPECT_EQ(Vector3::UnitY(), floors->up);
  EXPECT_FALSE(leaningFloor(floorsAlongY(20.0, 2), true)) << "a camera may see one wall";
  EXPECT_FALSE(leaningFloor(floorsAlongY(1.0, 2), false)) << "an object";
  EXPECT_FALSE(leaningFloor(floorsAlongY(20.0, 1), false)) << "a wall that was cut out";
  EXPECT_FALSE(leaningFloor(floorsAlongY(20.0, 2, false), false)) << "a scan in a corridor";
}

}  // namespace
}  // namespace planar_mapping::detail
