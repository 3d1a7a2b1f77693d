// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Where GroundTracker expects the ground when it is not told the height of the camera.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/ground/ground.h"
#include "planar_mapping/ground/up.h"

namespace planar_mapping {
namespace {

GroundTracker trackerOf(std::optional<double> height) {
  GroundParams params;
  params.camera_height = height;
  params.up = Vector3::UnitZ();
  params.optical_axis = Vector3::UnitX();
  return GroundTracker(params);
}

/// A level rectangle ahead of the sensor, this far below it; z is up.
std::vector<float> levelBelow(double below) {
  Random random(7);
  std::vector<float> xyz;
  for (double x = 1.0; x < 3.0; x += 0.02) {
    for (double y = -1.0; y < 1.0; y += 0.02) {
      xyz.insert(xyz.end(), {static_cast<float>(x), static_cast<float>(y),
                             static_cast<float>(-below + random.uniform(-0.003, 0.003))});
    }
  }
  return xyz;
}

/// A frame that sees a level surface from this altitude.
Ground see(GroundTracker& tracker, double below, double altitude = 0.0) {
  const std::vector<float> xyz = levelBelow(below);
  Pose pose = Pose::Identity();
  pose.translation() = Vector3(0.0, 0.0, altitude);
  Ground ground = tracker.update({xyz.data(), xyz.size() / 3}, nullptr, pose);
  // All of it or nothing.
  for (const std::uint8_t mark : ground.is_ground) {
    if (mark != (ground.found ? 1 : 0)) ADD_FAILURE() << "a part of the level surface is ground";
  }
  return ground;
}

bool isGround(GroundTracker& tracker, double below, double altitude = 0.0) {
  return see(tracker, below, altitude).found;
}

TEST(GroundTracker, LosesNoTableOnceItKnowsTheFloor) {
  GroundTracker tracker = trackerOf(std::nullopt);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isGround(tracker, 1.2)) << i;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(isGround(tracker, 0.5)) << i;
  EXPECT_TRUE(isGround(tracker, 1.2));
  // Unknown in every frame: whatever is level and lowest is the floor.
  GroundTracker unknown = trackerOf(0.0);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isGround(unknown, 1.2)) << i;
  EXPECT_TRUE(isGround(unknown, 0.5));
}

TEST(GroundTracker, FollowsTheCameraUpAndDown) {
  GroundTracker tracker = trackerOf(std::nullopt);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isGround(tracker, 1.2)) << i;
  // Lifted by 0.7 m: the floor is where the pose says, a shelf where the floor was is none.
  EXPECT_TRUE(isGround(tracker, 1.9, 0.7));
  EXPECT_FALSE(isGround(tracker, 1.2, 0.7));
  EXPECT_TRUE(isGround(tracker, 0.8, -0.4));
}

TEST(GroundTracker, FollowsASlope) {
  GroundTracker tracker = trackerOf(std::nullopt);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isGround(tracker, 1.2)) << i;
  // Down a ramp, 8 cm a frame.
  for (int i = 1; i < 10; ++i) EXPECT_TRUE(isGround(tracker, 1.2, -0.08 * i)) << i;
}

TEST(GroundTracker, LearnsAnewWhereTheGroundStaysElsewhere) {
  GroundTracker tracker = trackerOf(std::nullopt);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isGround(tracker, 1.2)) << i;
  // Lifted without a pose that says so.
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(isGround(tracker, 1.7)) << i;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(isGround(tracker, 1.7)) << i;
  EXPECT_FALSE(isGround(tracker, 1.2));
}

TEST(GroundTracker, KnowsNothingWhileFramesDisagree) {
  GroundTracker tracker = trackerOf(std::nullopt);
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(isGround(tracker, i % 2 == 0 ? 1.2 : 0.6)) << i;
}

TEST(GroundTracker, SurvivesFramesWithoutGround) {
  GroundTracker tracker = trackerOf(std::nullopt);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isGround(tracker, 1.2)) << i;
  std::vector<float> wall;
  for (float y = -1.0F; y < 1.0F; y += 0.02F) {
    for (float z = -1.0F; z < 1.0F; z += 0.02F) wall.insert(wall.end(), {2.0F, y, z});
  }
  for (int i = 0; i < 3; ++i)
    EXPECT_FALSE(tracker.update({wall.data(), wall.size() / 3}, nullptr).found);
  EXPECT_TRUE(isGround(tracker, 1.2));
}

TEST(GroundTracker, SaysThatTheGroundIsElsewhere) {
  GroundTracker tracker = trackerOf(std::nullopt);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isGround(tracker, 1.2)) << i;
  EXPECT_EQ(see(tracker, 0.5).diagnostics.status, GroundStatus::Elsewhere);
  tracker.reset();
  EXPECT_EQ(see(tracker, 0.5).diagnostics.status, GroundStatus::Found);
}

/// What rings of a scanner 1.6 m over the ground see of it and of stairs 3 m ahead, sensor's frame.
std::vector<float> ringsOnStairs(int rings) {
  constexpr double kHeight = 1.6, kFirst = 3.0, kRise = 0.17, kTread = 0.3;
  Random random(11);
  std::vector<float> xyz;
  for (int ring = 0; ring < rings; ++ring) {
    const double elevation = -25.0 * (ring + 1) / rings * M_PI / 180.0;
    for (double azimuth = -M_PI; azimuth < M_PI; azimuth += 0.0035) {
      const Vector3 ray(std::cos(elevation) * std::cos(azimuth),
                        std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      double range = -kHeight / ray.z();
      for (int k = 0; k < 8; ++k) {
        const double riser = (kFirst + k * kTread) / ray.x();
        const double tread = ((k + 1) * kRise - kHeight) / ray.z();
        for (const double t : {riser, tread}) {
          const Vector3 p = t * ray + kHeight * Vector3::UnitZ();
          const bool on = p.x() > kFirst + k * kTread - 1e-9 &&
                          p.x() < kFirst + (k + 1) * kTread + 1e-9 && std::abs(p.y()) < 1.5 &&
                          p.z() > k * kRise && p.z() < (k + 1) * kRise + 1e-9;
          if (t > 0.0 && on) range = std::min(range, t);
        }
      }
      if (!(range < 60.0)) continue;
      const Vector3 p = (range + random.uniform(-0.01, 0.01)) * ray;
      for (int i = 0; i < 3; ++i) xyz.push_back(static_cast<float>(p[i]));
    }
  }
  return xyz;
}

TEST(GroundTracker, KeepsStairsThatFewRingsSee) {
  for (const int rings : {32, 64}) {
    SCOPED_TRACE(rings);
    const std::vector<float> xyz = ringsOnStairs(rings);
    const PointsView points(xyz.data(), xyz.size() / 3, 1, 3);
    const Ground ground = trackerOf(std::nullopt).update(points, nullptr);
    ASSERT_TRUE(ground.found);
    std::size_t steps = 0, flat = 0, flat_kept = 0;
    for (std::size_t i = 0; i < points.size; ++i) {
      const double over = 1.6 + double{points[i][2]};
      if (over > 0.06) {
        ++steps;
        EXPECT_EQ(0, ground.is_ground[i]) << over;
      } else if (over < 0.02) {
        ++flat;
        flat_kept += ground.is_ground[i] == 0 ? 1 : 0;
      }
    }
    EXPECT_GT(steps, 100u);
    EXPECT_LT(flat_kept, flat / 50);
  }
}

TEST(GroundTracker, TheFirstCloudTellsTheVertical) {
  // A floor ahead of a camera (y down) that looks along x of the world: z of the world is up.
  std::vector<float> xyz;
  for (float x = -0.8F; x < 0.8F; x += 0.02F) {
    for (float z = 1.5F; z < 4.0F; z += 0.02F) xyz.insert(xyz.end(), {x, 1.1F, z});
  }
  Pose pose = Pose::Identity();
  pose.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  const PointsView camera(xyz.data(), xyz.size() / 3);
  EXPECT_TRUE(isCameraView(camera, nullptr));
  EXPECT_EQ(verticalOf(camera, nullptr, pose), Vector3::UnitZ());
  EXPECT_EQ(verticalOf(camera, nullptr, Pose::Identity()), -Vector3::UnitY());
  GroundTracker tracker;
  EXPECT_NEAR(tracker.update(camera, nullptr, pose).height, 1.1, 1e-3);
  const std::vector<float> scan = levelBelow(1.3);
  const PointsView level(scan.data(), scan.size() / 3);
  EXPECT_FALSE(isCameraView(level, nullptr));
  tracker.reset();
  EXPECT_NEAR(tracker.update(level, nullptr).height, 1.3, 1e-2);
}

TEST(GroundTracker, RejectsAPoseThatIsNone) {
  GroundTracker tracker;
  Pose pose = Pose::Identity();
  pose.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(tracker.update(PointsView(), nullptr, pose), InputError);
}

const Vector3 kLevel = -Vector3::UnitY();  // upwards for a level camera

/// A plane of the world (z up, the sensor at the origin) as a tilted camera sees it. Cameras look
/// along y of the world where they are level.
struct Tilted {
  Matrix3 R_camera_world = Matrix3::Identity();
  explicit Tilted(double pitch_down_deg, double roll_deg = 0.0, double yaw_deg = 0.0) {
    Matrix3 level;  // rows: x right, y down, z forward in world coordinates
    level << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
    R_camera_world = Eigen::AngleAxisd(roll_deg * test::kDegree, Vector3::UnitZ()) *
                     Eigen::AngleAxisd(pitch_down_deg * test::kDegree, Vector3::UnitX()) * level *
                     Eigen::AngleAxisd(yaw_deg * test::kDegree, Vector3::UnitZ());
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
  return std::atan2(a.cross(b).norm(), a.dot(b)) / test::kDegree;
}

TEST(Upright, LevelsByFloorAndWallHoweverLittleFloorIsSeen) {
  const Tilted camera(28.0, 2.0, 40.0);
  const std::vector<PlaneSegment> planes = {camera.plane({0.0, -1.0, 0.0}, 1.5, 9000),
                                            camera.plane({0.0, 0.0, 1.0}, 2.4, 800)};
  const Upright found = findUpright(planes, kLevel);
  ASSERT_TRUE(found.found);
  EXPECT_LT(degreesBetween(found.up, camera.up()), 1e-6);
  EXPECT_NEAR(degreesBetween(-Vector3::UnitY(), camera.up()) * test::kDegree, found.tilt, 1e-9);
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
  const Tilted level(15.0);
  const Upright room = findUpright(
      {level.plane({0.0, 0.0, 1.0}, 1.0, 2000), level.plane({0.0, -1.0, 0.0}, 2.0, 8000)}, kLevel);
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
  EXPECT_THROW(findUpright({}, Vector3::Zero()), ParameterError);
  EXPECT_THROW(findUpright({}, Vector3(test::kNan, 1.0, 0.0)), ParameterError);
  const Tilted camera(20.0);
  PlaneSegment broken = camera.plane({0.0, 0.0, 1.0}, 1.0, 100);
  broken.plane.normal.x() = test::kNan;
  const PlaneSegment empty = camera.plane({0.0, 0.0, 1.0}, 1.0, 0);
  EXPECT_FALSE(findUpright({broken, empty}, kLevel).found);
}

/// A hand-held camera looks down by 70 degrees at a table, and sees nothing else.
TEST(UpOf, PosesOfAWorldThatIsZUpKeepItWhereOneTableIsSeen) {
  const Tilted camera(70.0);
  Pose pose = Pose::Identity();
  pose.linear() = camera.R_camera_world.transpose();
  const Vector3 image_up = -pose.linear().col(1);
  const std::vector<PlaneSegment> table = {camera.plane({0.0, 0.0, 1.0}, 0.5, 5000)};
  const WorldUp found = upOf(nearestAxis(image_up), ImagesUp{image_up, false}, pose, table);
  EXPECT_EQ(Vector3::UnitZ(), found.up);
  EXPECT_FALSE(found.is_leaning || found.is_uncertain);
}

/// The same table seen by a camera whose own frame is the world.
TEST(UpOf, AWorldOfTheFirstCameraIsLevelByItsPlanes) {
  const Tilted camera(35.0);
  const std::vector<PlaneSegment> table = {camera.plane({0.0, 0.0, 1.0}, 0.5, 5000)};
  const ImagesUp images{Vector3(0.0, -0.9, 0.3), true};
  const WorldUp found = upOf(-Vector3::UnitY(), images, Pose::Identity(), table);
  EXPECT_TRUE(found.is_leaning);
  EXPECT_LT(degreesBetween(camera.up(), found.up), 0.1);
  const WorldUp blind = upOf(-Vector3::UnitY(), images, Pose::Identity(), {});
  EXPECT_EQ(Vector3(-Vector3::UnitY()), blind.up);
}

/// Images say z; one plane that leans is a ramp, a floor with a wall are a world that leans.
TEST(UpOf, FloorsAndWallsTogetherOverruleZ) {
  const Tilted camera(0.0);
  Pose pose = Pose::Identity();
  pose.linear() =
      Eigen::AngleAxisd(20.0 * test::kDegree, Vector3::UnitX()) * camera.R_camera_world.transpose();
  const ImagesUp images{Vector3(0.1, 0.0, 1.0), false};
  const PlaneSegment floor = camera.plane({0.0, 0.0, 1.0}, 0.5, 5000);
  EXPECT_EQ(Vector3::UnitZ(), upOf(Vector3::UnitZ(), images, pose, {floor}).up);
  const PlaneSegment wall = camera.plane({0.0, -1.0, 0.0}, 2.0, 3000);
  const WorldUp found = upOf(Vector3::UnitZ(), images, pose, {floor, wall});
  EXPECT_TRUE(found.is_leaning);
  EXPECT_LT(degreesBetween(Vector3(pose.linear() * camera.up()), found.up), 0.1);
}

}  // namespace
}  // namespace planar_mapping
