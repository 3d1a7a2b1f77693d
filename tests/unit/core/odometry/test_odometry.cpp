// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/odometry/odometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "feature_corridor.h"

namespace planar_mapping {
namespace {

using test::positionError;
using test::worldParams;
using World = test::FeatureCorridor;

TEST(Odometry, FirstFrameIsAtTheStartPose) {
  World world;
  Odometry odometry(worldParams());
  EXPECT_FALSE(odometry.started());
  odometry.setStart(World::poseAt(3.0));
  const OdometryResult result = odometry.update(world.see(World::poseAt(0.0)));
  EXPECT_TRUE(result.registered);
  EXPECT_FALSE(result.motion.has_value());
  EXPECT_TRUE(result.T_world_sensor.isApprox(World::poseAt(3.0), 1e-12));
  EXPECT_TRUE(odometry.started());
}

TEST(Odometry, FollowsACorridorWithLittleDrift) {
  World world;
  Odometry odometry(worldParams());
  odometry.setStart(World::poseAt(0.0));
  OdometryResult result;
  Pose truth;
  for (int i = 0; i <= 60; ++i) {
    truth = World::poseAt(0.1 * i, 0.2 * std::sin(0.1 * i), 0.1 * std::sin(0.15 * i));
    result = odometry.update(world.see(truth));
    ASSERT_TRUE(result.registered) << i << ": " << result.reason;
  }
  EXPECT_LT(positionError(result.T_world_sensor, truth), 0.06);  // 1 % of 6 m
  EXPECT_GT(result.inliers, 150u);
}

TEST(Odometry, LargeStepsWork) {
  World world;
  Odometry odometry(worldParams());
  odometry.setStart(World::poseAt(0.0));
  for (int i = 0; i <= 12; ++i) {
    const Pose truth = World::poseAt(1.0 * i);
    const OdometryResult result = odometry.update(world.see(truth));
    ASSERT_TRUE(result.registered) << i << ": " << result.reason;
    EXPECT_LT(positionError(result.T_world_sensor, truth), 0.01 + 0.005 * i);
  }
}

TEST(Odometry, MotionIsThatSinceTheFrameBefore) {
  World world;
  Odometry odometry(worldParams());
  odometry.setStart(World::poseAt(0.0));
  Pose before;
  for (int i = 0; i <= 10; ++i) {
    const Pose truth = World::poseAt(0.2 * i, 0.0, 0.02 * i);
    const OdometryResult result = odometry.update(world.see(truth));
    ASSERT_TRUE(result.registered);
    if (i > 0) {
      ASSERT_TRUE(result.motion.has_value());
      result.motion->validate();
      const Pose expected = truth.inverse() * before;
      EXPECT_LT(motionDifference(expected, result.motion->T_now_before).head<3>().norm(), 0.03);
      EXPECT_LT(motionDifference(expected, result.motion->T_now_before).tail<3>().norm(), 0.01);
      EXPECT_EQ(result.motion->predicted.has_value(), i > 1);
    }
    before = truth;
  }
}

TEST(Odometry, CameraAtRestAddsNothing) {
  World world;
  Odometry odometry(worldParams());
  odometry.setStart(World::poseAt(0.0));
  odometry.update(world.see(World::poseAt(0.0)));
  std::size_t landmarks = 0;
  OdometryResult result;
  for (int i = 0; i < 100; ++i) {
    result = odometry.update(world.see(World::poseAt(0.0)));
    ASSERT_TRUE(result.registered);
    if (i == 0) landmarks = odometry.landmarks();
  }
  EXPECT_EQ(odometry.landmarks(), landmarks);
  EXPECT_LT(positionError(result.T_world_sensor, World::poseAt(0.0)), 0.02);
}

TEST(Odometry, PointsBesideTheCameraAgreeWithNoSighting) {
  // By the given pose the camera stands where it saw points: there all depths are uncertain.
  World world;
  Odometry odometry(worldParams());
  odometry.setStart(World::poseAt(0.0));
  const std::vector<KeyFeature> seen = world.see(World::poseAt(0.0));
  odometry.update(seen);
  for (double x = 2.0; x < 8.0; x += 0.05) {
    PosePrior prior;
    prior.T_world_sensor = World::poseAt(x);
    prior.exact = true;
    Odometry there = odometry;
    EXPECT_LT(there.update(seen, prior).rms_px, 200.0) << x;
  }
}

TEST(Odometry, FindsAJumpOfTwoMetresOverKnownFeatures) {
  World world;
  Odometry odometry(worldParams());
  odometry.setStart(World::poseAt(0.0));
  for (int i = 0; i < 4; ++i) odometry.update(world.see(World::poseAt(0.05 * i)));
  const Pose there = World::poseAt(2.15);
  const OdometryResult result = odometry.update(world.see(there));
  ASSERT_TRUE(result.registered) << result.reason;
  EXPECT_TRUE(result.jump);
  EXPECT_LT(positionError(result.T_world_sensor, there), 0.05);
  const OdometryResult next = odometry.update(world.see(World::poseAt(2.2)));
  ASSERT_TRUE(next.registered);
  EXPECT_FALSE(next.jump);
}

TEST(Odometry, AJumpOfASixthOfManyKnownFeaturesIsNotBelieved) {
  for (const bool many_agree : {false, true}) {
    World world;
    OdometryParams params = worldParams();
    params.jump_inliers = 15;
    Odometry odometry(params);
    odometry.setStart(World::poseAt(0.0));
    for (int i = 0; i < 4; ++i) odometry.update(world.see(World::poseAt(0.05 * i)));
    std::vector<KeyFeature> seen = world.see(World::poseAt(1.15));
    // The others are taken for one another.
    std::size_t right = 0;
    std::vector<std::size_t> wrong;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (i % (many_agree ? 2 : 6) == 0) {
        ++right;
      } else {
        wrong.push_back(i);
      }
    }
    for (std::size_t k = 1; k < wrong.size(); ++k)
      std::swap(seen[wrong[k - 1]].track, seen[wrong[k]].track);
    ASSERT_GE(right, 33u);
    const OdometryResult result = odometry.update(seen);
    EXPECT_EQ(result.registered, many_agree) << result.reason;
    EXPECT_EQ(result.reason.find("agree on a jump") != std::string::npos, !many_agree);
  }
}

TEST(Odometry, ExactPosesAreTaken) {
  World world;
  Odometry odometry(worldParams());
  for (int i = 0; i < 10; ++i) {
    const Pose truth = World::poseAt(0.2 * i);
    PosePrior given;
    given.T_world_sensor = truth;
    given.exact = true;
    const OdometryResult result = odometry.update(world.see(truth), given);
    ASSERT_TRUE(result.registered);
    EXPECT_TRUE(result.T_world_sensor.isApprox(truth, 1e-12));
  }
  // From there on by features.
  const Pose truth = World::poseAt(2.0);
  const OdometryResult result = odometry.update(world.see(truth));
  ASSERT_TRUE(result.registered);
  EXPECT_LT(positionError(result.T_world_sensor, truth), 0.03);
}

TEST(Odometry, PriorHoldsTheDriftAndRestartsWhereNothingIsKnown) {
  World world;
  Odometry odometry(worldParams());
  PosePrior given;
  given.covariance = 1e-4 * Matrix6::Identity();
  for (int i = 0; i < 20; ++i) {
    given.T_world_sensor = World::poseAt(0.3 * i);
    const OdometryResult result = odometry.update(world.see(given.T_world_sensor), given);
    ASSERT_TRUE(result.registered);
    EXPECT_LT(positionError(result.T_world_sensor, given.T_world_sensor), 0.03);
    EXPECT_EQ(result.from_prior, i == 0);
  }
  given.T_world_sensor = World::poseAt(28.0);
  const OdometryResult elsewhere = odometry.update(world.see(given.T_world_sensor), given);
  ASSERT_TRUE(elsewhere.registered);
  EXPECT_TRUE(elsewhere.from_prior);
  EXPECT_FALSE(elsewhere.reason.empty());
  EXPECT_LT(positionError(elsewhere.T_world_sensor, given.T_world_sensor), 1e-3);
  const Pose next = World::poseAt(28.1);
  const OdometryResult result = odometry.update(world.see(next));
  ASSERT_TRUE(result.registered) << result.reason;
  EXPECT_LT(positionError(result.T_world_sensor, next), 0.05);
}

/// A depth camera that measures 2 % too much: 200 features agree on steps that are too long.
TEST(Odometry, ManyFeaturesDoNotOutweighPosesMeasuredWithoutThem) {
  for (const bool independent : {false, true}) {
    World world;
    Odometry odometry(worldParams());
    PosePrior given;
    given.covariance = 4e-4 * Matrix6::Identity();
    given.independent = independent;
    double worst = 0.0;
    for (int i = 0; i < 40; ++i) {
      given.T_world_sensor = World::poseAt(0.3 * i);
      std::vector<KeyFeature> features = world.see(given.T_world_sensor);
      for (KeyFeature& feature : features) feature.position *= 1.02F;
      const OdometryResult result = odometry.update(features, given);
      ASSERT_TRUE(result.registered);
      EXPECT_EQ(result.from_prior, i == 0);
      worst = std::max(worst, positionError(result.T_world_sensor, given.T_world_sensor));
    }
    if (independent) {
      EXPECT_LT(worst, 0.07);
    } else {
      EXPECT_GT(worst, 0.1) << "the features do not drift: the test tells nothing";
    }
  }
}

TEST(Odometry, MemoryIsBounded) {
  World world;
  OdometryParams params = worldParams();
  params.max_landmarks = 400;
  Odometry odometry(params);
  odometry.setStart(World::poseAt(0.0));
  OdometryResult result;
  for (int i = 0; i <= 50; ++i) {
    result = odometry.update(world.see(World::poseAt(0.4 * i)));
    ASSERT_TRUE(result.registered) << i << result.reason;
    EXPECT_LE(odometry.landmarks(), 800u);  // 400 and those of the frame
  }
  EXPECT_LT(positionError(result.T_world_sensor, World::poseAt(20.0)), 0.4);
}

TEST(Odometry, OrderOfFeaturesDoesNotMatter) {
  World world;
  Odometry one(worldParams());
  Odometry two(worldParams());
  for (int i = 0; i < 8; ++i) {
    std::vector<KeyFeature> features = world.see(World::poseAt(0.2 * i));
    world.confuse(features, 0.1);
    const OdometryResult a = one.update(features);
    std::reverse(features.begin(), features.end());
    const OdometryResult b = two.update(features);
    EXPECT_EQ(a.T_world_sensor.matrix(), b.T_world_sensor.matrix());
    EXPECT_EQ(a.inliers, b.inliers);
  }
}

TEST(Odometry, CopiesGoTheirOwnWay) {
  World world;
  Odometry odometry(worldParams());
  odometry.update(world.see(World::poseAt(0.0)));
  Odometry copy = odometry;
  const auto features = world.see(World::poseAt(0.1));
  const OdometryResult looked = odometry.locate(features);
  const OdometryResult a = odometry.update(features);
  const OdometryResult b = copy.update(features);
  ASSERT_TRUE(looked.registered);
  EXPECT_EQ(a.T_world_sensor.matrix(), b.T_world_sensor.matrix());
  EXPECT_LT(positionError(looked.T_world_sensor, a.T_world_sensor), 0.05);
}

}  // namespace
}  // namespace planar_mapping
