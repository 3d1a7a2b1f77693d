// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Where GroundTracker expects the ground when it is not told the height of the camera.
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/ground/ground.h"

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
  for (int i = 1; i < 10; ++i) {
    EXPECT_TRUE(isGround(tracker, 1.2, -0.08 * i)) << i;
  }
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
  for (int i = 0; i < 8; ++i) {
    EXPECT_TRUE(isGround(tracker, i % 2 == 0 ? 1.2 : 0.6)) << i;
  }
}

TEST(GroundTracker, SurvivesFramesWithoutGround) {
  GroundTracker tracker = trackerOf(std::nullopt);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isGround(tracker, 1.2)) << i;
  std::vector<float> wall;
  for (float y = -1.0F; y < 1.0F; y += 0.02F) {
    for (float z = -1.0F; z < 1.0F; z += 0.02F) wall.insert(wall.end(), {2.0F, y, z});
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(tracker.update({wall.data(), wall.size() / 3}, nullptr).found);
  }
  EXPECT_TRUE(isGround(tracker, 1.2));
}

TEST(GroundTracker, SaysThatTheGroundIsElsewhere) {
  GroundTracker tracker = trackerOf(std::nullopt);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isGround(tracker, 1.2)) << i;
  EXPECT_EQ(see(tracker, 0.5).diagnostics.status, GroundStatus::Elsewhere);
  tracker.reset();
  EXPECT_EQ(see(tracker, 0.5).diagnostics.status, GroundStatus::Found);
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

}  // namespace
}  // namespace planar_mapping
