// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Where the stage expects the ground when it is not told the height of the camera.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/pipeline/pipeline.h"

namespace planar_mapping {
namespace {

Pipeline removalOf(const std::string& height) {
  StageTable table;
  registerBuiltinStages(table);
  return Pipeline(parseConfiguration(
      "version: 1\nstages:\n  - stage: ground_removal\n    camera_height_m: " + height +
          "\n    up: [0, 0, 1]\n    optical_axis: [1, 0, 0]\n",
      "test", table));
}

/// A level rectangle ahead of the sensor, this far below it; z is up.
void addLevel(double below, double from, double to, FrameCloud& cloud, std::uint64_t seed) {
  Random random(seed);
  for (double x = from; x < to; x += 0.02) {
    for (double y = -1.0; y < 1.0; y += 0.02) {
      cloud.push_back({static_cast<float>(x), static_cast<float>(y),
                       static_cast<float>(-below + random.uniform(-0.003, 0.003))});
    }
  }
}

/// A frame that sees a level surface from this altitude.
Frame frameOver(double below, double altitude = 0.0) {
  Frame frame;
  frame.source = "test";
  frame.cloud = pcl::make_shared<FrameCloud>();
  addLevel(below, 1.0, 3.0, *frame.cloud, 7);
  frame.T_world_sensor.translation() = Vector3(0.0, 0.0, altitude);
  return frame;
}

bool isRemoved(Pipeline& pipeline, Frame frame) {
  pipeline.process(frame);
  // All of it or nothing.
  EXPECT_TRUE(frame.ground.empty() || frame.indices.empty());
  return !frame.ground.empty();
}

TEST(GroundRemoval, AutoLosesNoTableOnceItKnowsTheFloor) {
  Pipeline pipeline = removalOf("auto");
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isRemoved(pipeline, frameOver(1.2))) << i;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(isRemoved(pipeline, frameOver(0.5))) << i;
  EXPECT_TRUE(isRemoved(pipeline, frameOver(1.2)));
  // Unknown in every frame: whatever is level and lowest is the floor.
  Pipeline unknown = removalOf("0");
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isRemoved(unknown, frameOver(1.2))) << i;
  EXPECT_TRUE(isRemoved(unknown, frameOver(0.5)));
}

TEST(GroundRemoval, AutoFollowsTheCameraUpAndDown) {
  Pipeline pipeline = removalOf("auto");
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isRemoved(pipeline, frameOver(1.2))) << i;
  // Lifted by 0.7 m: the floor is where the pose says, a shelf where the floor was is none.
  EXPECT_TRUE(isRemoved(pipeline, frameOver(1.9, 0.7)));
  EXPECT_FALSE(isRemoved(pipeline, frameOver(1.2, 0.7)));
  EXPECT_TRUE(isRemoved(pipeline, frameOver(0.8, -0.4)));
}

TEST(GroundRemoval, AutoFollowsASlope) {
  Pipeline pipeline = removalOf("auto");
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isRemoved(pipeline, frameOver(1.2))) << i;
  // Down a ramp, 8 cm a frame.
  for (int i = 1; i < 10; ++i) {
    EXPECT_TRUE(isRemoved(pipeline, frameOver(1.2, -0.08 * i))) << i;
  }
}

TEST(GroundRemoval, AutoLearnsAnewWhereTheGroundStaysElsewhere) {
  Pipeline pipeline = removalOf("auto");
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isRemoved(pipeline, frameOver(1.2))) << i;
  // Lifted without a pose that says so.
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(isRemoved(pipeline, frameOver(1.7))) << i;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(isRemoved(pipeline, frameOver(1.7))) << i;
  EXPECT_FALSE(isRemoved(pipeline, frameOver(1.2)));
}

TEST(GroundRemoval, AutoKnowsNothingWhileFramesDisagree) {
  Pipeline pipeline = removalOf("auto");
  for (int i = 0; i < 8; ++i) {
    EXPECT_TRUE(isRemoved(pipeline, frameOver(i % 2 == 0 ? 1.2 : 0.6))) << i;
  }
}

TEST(GroundRemoval, AutoSurvivesFramesWithoutGround) {
  Pipeline pipeline = removalOf("auto");
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(isRemoved(pipeline, frameOver(1.2))) << i;
  Frame wall;
  wall.source = "wall";
  wall.cloud = pcl::make_shared<FrameCloud>();
  for (float y = -1.0F; y < 1.0F; y += 0.02F) {
    for (float z = -1.0F; z < 1.0F; z += 0.02F) wall.cloud->push_back({2.0F, y, z});
  }
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(isRemoved(pipeline, wall));
  EXPECT_TRUE(isRemoved(pipeline, frameOver(1.2)));
}

}  // namespace
}  // namespace planar_mapping
