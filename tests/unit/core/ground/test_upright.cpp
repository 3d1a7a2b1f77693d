// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/ground/detail/upright.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

constexpr double kDegree = M_PI / 180.0;
const Vector3 kLevel = -Vector3::UnitY();  // upwards for a level camera

/// A plane of the world (z up, the sensor at the origin) as a tilted camera sees it. Cameras look
/// along y of the world where they are level.
struct Tilted {
  Matrix3 R_camera_world = Matrix3::Identity();
  explicit Tilted(double pitch_down_deg, double roll_deg = 0.0, double yaw_deg = 0.0) {
    Matrix3 level;  // rows: x right, y down, z forward in world coordinates
    level << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
    R_camera_world = Eigen::AngleAxisd(roll_deg * kDegree, Vector3::UnitZ()) *
                     Eigen::AngleAxisd(pitch_down_deg * kDegree, Vector3::UnitX()) * level *
                     Eigen::AngleAxisd(yaw_deg * kDegree, Vector3::UnitZ());
  }
  Vector3 up() const { return R_camera_world * Vector3::UnitZ(); }
  /// \param normal in the world, towards the sensor
  PlaneSegment plane(const Vector3& normal, double distance, std::size_t points) const {
    PlaneSegment segment;
    segment.plane.normal = R_camera_world * normal.normalized();
    segment.plane.offset = distance;
    segment.inliers.resize(points);
    return segment;
  }
};

double degreesBetween(const Vector3& a, const Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kDegree;
}

TEST(Upright, LevelsByFloorAndWallHoweverLittleFloorIsSeen) {
  const Tilted camera(28.0, 2.0, 40.0);
  const std::vector<PlaneSegment> planes = {camera.plane({0.0, -1.0, 0.0}, 1.5, 9000),
                                            camera.plane({0.0, 0.0, 1.0}, 2.4, 800)};
  const Upright found = findUpright(planes, kLevel);
  ASSERT_TRUE(found.found);
  EXPECT_LT(degreesBetween(found.up, camera.up()), 1e-6);
  EXPECT_NEAR(degreesBetween(-Vector3::UnitY(), camera.up()) * kDegree, found.tilt, 1e-9);
  EXPECT_NEAR(800.0 / 9800.0, found.horizontal, 1e-12);
  EXPECT_NEAR(9000.0 / 9800.0, found.vertical, 1e-12);
}

TEST(Upright, LevelsByTwoWallsOrACeiling) {
  const Tilted camera(-20.0, 5.0, 30.0);
  const PlaneSegment left = camera.plane({1.0, 0.0, 0.0}, 1.0, 4000);
  const PlaneSegment front = camera.plane({0.0, -1.0, 0.0}, 3.0, 5000);
  const PlaneSegment ceiling = camera.plane({0.0, 0.0, -1.0}, 2.0, 3000);
  for (const auto& planes : {std::vector<PlaneSegment>{left, front}, {front, ceiling}}) {
    const Upright found = findUpright(planes, kLevel);
    ASSERT_TRUE(found.found);
    EXPECT_LT(degreesBetween(found.up, camera.up()), 1e-6);
  }
}

TEST(Upright, LevelsByABareFloorBelowOnly) {
  const Tilted camera(35.0);
  const Upright floor = findUpright({camera.plane({0.0, 0.0, 1.0}, 1.2, 5000)}, kLevel);
  ASSERT_TRUE(floor.found);
  EXPECT_LT(degreesBetween(floor.up, camera.up()), 1e-6);
  // A slanted plane overhead could be anything.
  const Upright roof = findUpright({camera.plane({0.0, 0.0, -1.0}, 1.2, 5000)}, kLevel);
  EXPECT_FALSE(roof.found);
  EXPECT_EQ(Vector3(-Vector3::UnitY()), roof.up);
}

TEST(Upright, StaysLevelWhereThePlanesDoNotTell) {
  EXPECT_FALSE(findUpright({}, kLevel).found);
  const Tilted camera(20.0, 0.0, 10.0);
  // One wall leaves the turn about its normal open.
  EXPECT_FALSE(findUpright({camera.plane({0.0, -1.0, 0.0}, 2.0, 9000)}, kLevel).found);
  // What a level camera sees confirms that it is level.
  const Tilted level(0.0, 0.0, 30.0);
  EXPECT_FALSE(findUpright({level.plane({0.0, 0.0, 1.0}, 0.4, 3000),
                            level.plane({0.0, -1.0, 0.0}, 2.0, 3000),
                            level.plane({0.3, 0.0, 1.0}, 2.0, 3000)},
                           kLevel)
                   .found);
  // A ramp is not taken for the floor where the walls say otherwise.
  EXPECT_FALSE(findUpright({level.plane({0.0, -0.3, 1.0}, 0.4, 3500),
                            level.plane({0.0, -1.0, 0.0}, 2.0, 3200),
                            level.plane({-1.0, 0.0, 0.0}, 2.0, 3200)},
                           kLevel)
                   .found);
}

// A camera that looks up at a ceiling by the rest of 90 degrees sees the same.
TEST(Upright, LooksDownAtAFloorRatherThanUpAtACeiling) {
  for (const double pitch : {35.0, 45.0, 60.0}) {
    const Tilted camera(pitch, 3.0);
    const Upright found = findUpright(
        {camera.plane({0.0, 0.0, 1.0}, 1.0, 4000), camera.plane({0.0, -1.0, 0.0}, 2.0, 3000)},
        kLevel);
    ASSERT_TRUE(found.found) << pitch;
    EXPECT_LT(degreesBetween(found.up, camera.up()), 1e-6) << pitch;
  }
}

/// A camera of a robot's arm that looks down at a table beyond its own foot, and at a board that
/// leans: the line in which both meet explains as much.
TEST(Upright, IsUncertainWhereWallsMayBeFloors) {
  const Tilted camera(108.0);
  const std::vector<PlaneSegment> planes = {camera.plane({0.0, 0.0, 1.0}, 0.35, 3000),
                                            camera.plane({0.02, 0.0, 1.0}, 0.9, 3000),
                                            camera.plane({0.93, 0.2, 0.32}, 0.7, 3200)};
  const Upright found = findUpright(planes, kLevel);
  EXPECT_TRUE(found.found && found.is_uncertain);
  EXPECT_EQ(0.0, found.horizontal);
  const Upright by_axis = findUpright(planes, kLevel, camera.up());
  EXPECT_TRUE(by_axis.found && by_axis.is_uncertain);
  EXPECT_EQ(camera.up(), by_axis.up);
  EXPECT_EQ(found.up, findUpright(planes, kLevel, Vector3(-camera.up())).up);  // a ceiling

  const Tilted level(15.0);
  const Upright room = findUpright(
      {level.plane({0.0, 0.0, 1.0}, 1.0, 2000), level.plane({0.0, -1.0, 0.0}, 2.0, 8000)}, kLevel,
      Vector3(level.R_camera_world.col(1)));
  EXPECT_TRUE(room.found);
  EXPECT_FALSE(room.is_uncertain);
}

TEST(Upright, LeavesOutWhatIsNeitherHorizontalNorVertical) {
  const Tilted camera(15.0, -4.0, 70.0);
  const Upright found = findUpright(
      {camera.plane({0.0, 0.0, 1.0}, 0.8, 4000), camera.plane({0.0, -1.0, 0.0}, 2.0, 3000),
       camera.plane({0.5, 0.2, 0.7}, 2.0, 2500)},
      kLevel);
  ASSERT_TRUE(found.found);
  EXPECT_LT(degreesBetween(found.up, camera.up()), 1e-6);
  EXPECT_NEAR(7000.0 / 9500.0, found.horizontal + found.vertical, 1e-12);
}

TEST(Upright, RefusesABadDirectionAndTakesAnyPlanes) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(findUpright({}, Vector3::Zero()), ParameterError);
  EXPECT_THROW(findUpright({}, Vector3(kNan, 1.0, 0.0)), ParameterError);
  const Tilted camera(20.0);
  PlaneSegment broken = camera.plane({0.0, 0.0, 1.0}, 1.0, 100);
  broken.plane.normal.x() = kNan;
  const PlaneSegment empty = camera.plane({0.0, 0.0, 1.0}, 1.0, 0);
  EXPECT_FALSE(findUpright({broken, empty}, kLevel).found);
}

}  // namespace
}  // namespace planar_mapping
