// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "planar_mapping/pipeline/advice/leaning_floor.h"
#include "planar_mapping/pipeline/advice/watches.h"
#include "map_scene.h"
#include "numbers.h"
#include "planar_mapping/geometry/camera.h"
#include "ring_scan.h"

namespace planar_mapping::detail {
namespace {

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
    const std::optional<LeaningFloor> floor =
        leaningFloor(roomTiltedBy(degrees * test::kDegree), true);
    ASSERT_TRUE(floor) << degrees;
    EXPECT_NEAR(floor->tilt, std::abs(degrees) * test::kDegree, 0.5 * test::kDegree);
    EXPECT_GT(floor->area, 4.0);
    EXPECT_LT(floor->area, 24.0);
  }
}

TEST(LeaningFloor, IsNoneInALevelRoomNorInAnEmptyMap) {
  EXPECT_FALSE(leaningFloor(roomTiltedBy(0.0), true));
  EXPECT_FALSE(leaningFloor(roomTiltedBy(3.0 * test::kDegree), true));
  EXPECT_FALSE(leaningFloor(PlanarMap(), false));
}

TEST(LeaningFloor, CeilingsThatLeanAreNone) {
  PlanarMap map;
  test::View view = test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.0, -0.9));
  view.pose = Eigen::AngleAxisd(20.0 * test::kDegree, Vector3::UnitX()) * view.pose;
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
  const double right_angle = 90.0 * test::kDegree;
  const std::optional<LeaningFloor> floor = leaningFloor(scanTurnedBy(-right_angle, true), false);
  ASSERT_TRUE(floor);
  EXPECT_EQ(LeaningFloor::Kind::LevelWithoutTurn, floor->kind);
  EXPECT_NEAR(floor->tilt, right_angle, test::kDegree);
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

/// What is said of a scan from \p place in a room of 2 \p half_length x 6 x 3 m by a pose that is
/// off by \p error.
std::optional<double> misfitOf(PoseWatch& watch, const Vector3& place, const Vector3& error,
                               double half_length = 4.0) {
  const Eigen::Array3d low(-half_length, -3, 0), high(half_length, 3, 3);
  const std::vector<float> xyz = test::boxScan(low - place.array(), high - place.array(), 40.0);
  const PointsView points(xyz.data(), xyz.size() / 3);
  return watch.misfit(points, findPlanes(points, nullptr, MultiPlaneParams()).planes,
                      Pose(Eigen::Translation3d(place + error)), CuboidApproximationParams());
}

TEST(PoseWatch, PosesThatFitSayNothing) {
  PoseWatch watch;
  for (const double x : {-2.0, -1.0, 0.0, 0.5})
    EXPECT_FALSE(misfitOf(watch, {x, 0.3 * x, 1.2}, Vector3::Zero())) << x;
}

TEST(PoseWatch, TheFirstPoseThatDoesNotFitIsSaidOnce) {
  PoseWatch watch;
  EXPECT_FALSE(misfitOf(watch, {-1.0, 0.0, 1.2}, Vector3::Zero()));
  const std::optional<double> misfit = misfitOf(watch, {0.0, 0.0, 1.2}, {0.25, 0.25, 0.0});
  ASSERT_TRUE(misfit);
  EXPECT_NEAR(*misfit, 0.25, 0.03);
  EXPECT_FALSE(misfitOf(watch, {1.0, 0.0, 1.2}, {-0.3, 0.3, 0.0}));
}

TEST(PoseWatch, StepsAlongAHallAreJudgedByWhatStandsAcross) {
  PoseWatch watch;
  EXPECT_FALSE(misfitOf(watch, {-1.0, 0.0, 1.2}, Vector3::Zero(), 9.0));
  const std::optional<double> misfit = misfitOf(watch, {0.0, 0.0, 1.2}, {0.4, 0.0, 0.0}, 9.0);
  ASSERT_TRUE(misfit);
  EXPECT_NEAR(*misfit, 0.4, 0.03);
}

/// A corner of a room, 4 m away, as a camera with a field of 65 degrees sees it.
/// \param along_ray  as distances, which are taken for depths
std::vector<float> corner(bool along_ray) {
  const PinholeCamera camera{250.0, 250.0, 159.5, 119.5, 320, 240};
  std::vector<float> xyz;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const Vector3 ray = camera.rayOf(column, row);
      const Vector3 left = Vector3(-0.6, 0.0, 0.8);
      const Vector3 right = Vector3(0.8, 0.0, 0.6);
      double depth = 1e9;
      for (const auto& [normal, distance] :
           {std::pair(left, 3.2), std::pair(right, 2.4), std::pair(Vector3(0.0, 1.0, 0.0), 1.2)}) {
        const double along = normal.dot(ray);
        if (along > 0.0) depth = std::min(depth, distance / along);
      }
      if (along_ray) depth *= ray.norm();
      for (int k = 0; k < 3; ++k) xyz.push_back(static_cast<float>(depth * ray[k]));
    }
  }
  return xyz;
}

TEST(DepthWatch, DistancesAlongRaysAreSaidOnceInTheSecondFrame) {
  const std::vector<float> xyz = corner(true);
  const PointsView points(xyz.data(), 320, 240, 3);
  DepthWatch watch;
  EXPECT_FALSE(watch.isBentIn(points, false));
  EXPECT_TRUE(watch.isBentIn(points, false));
  EXPECT_FALSE(watch.isBentIn(points, false));
  EXPECT_TRUE(DepthWatch().isBentIn(points, true));
}

TEST(DepthWatch, DepthsAlongTheAxisSayNothing) {
  const std::vector<float> xyz = corner(false);
  DepthWatch watch;
  for (int frame = 0; frame < 6; ++frame)
    EXPECT_FALSE(watch.isBentIn(PointsView(xyz.data(), 320, 240, 3), false)) << frame;
  EXPECT_FALSE(DepthWatch().isBentIn(PointsView(xyz.data(), 320, 240, 3), true));
}

}  // namespace
}  // namespace planar_mapping::detail
