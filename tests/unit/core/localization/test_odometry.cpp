// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "feature_corridor.h"
#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/localization/odometry/odometry.h"

namespace planar_mapping {
namespace {

using namespace test;
using World = test::FeatureCorridor;

class OdometryTest : public testing::Test {
 protected:
  World world;
  Odometry odometry{worldParams()};
};

TEST_F(OdometryTest, FirstFrameIsAtTheStartPose) {
  EXPECT_FALSE(odometry.started());
  odometry.setStart(World::poseAt(3.0));
  const OdometryResult result = odometry.update(world.see(World::poseAt(0.0)));
  EXPECT_TRUE(result.registered);
  EXPECT_FALSE(result.motion.has_value());
  EXPECT_TRUE(result.T_world_sensor.isApprox(World::poseAt(3.0), 1e-12));
  EXPECT_TRUE(odometry.started());
}

TEST_F(OdometryTest, FollowsACorridorWithLittleDrift) {
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

TEST_F(OdometryTest, LargeStepsWork) {
  odometry.setStart(World::poseAt(0.0));
  for (int i = 0; i <= 12; ++i) {
    const Pose truth = World::poseAt(1.0 * i);
    const OdometryResult result = odometry.update(world.see(truth));
    ASSERT_TRUE(result.registered) << i << ": " << result.reason;
    EXPECT_LT(positionError(result.T_world_sensor, truth), 0.01 + 0.005 * i);
  }
}

TEST_F(OdometryTest, MotionIsThatSinceTheFrameBefore) {
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

TEST_F(OdometryTest, CameraAtRestAddsNothing) {
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

TEST_F(OdometryTest, PointsBesideTheCameraAgreeWithNoSighting) {
  // By the given pose the camera stands where it saw points: there all depths are uncertain.
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

TEST_F(OdometryTest, FindsAJumpOfTwoMetresOverKnownFeatures) {
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

TEST_F(OdometryTest, ExactPosesAreTaken) {
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

TEST_F(OdometryTest, PriorHoldsTheDriftAndRestartsWhereNothingIsKnown) {
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

TEST_F(OdometryTest, CopiesGoTheirOwnWay) {
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

// Odometry on features that are wrong, unknown or unusable, and on bad parameters.

TEST_F(OdometryTest, FrozenImagesAreNoMotion) {
  const auto features = world.see(World::poseAt(0.0));
  odometry.update(features);
  for (int i = 0; i < 3; ++i) {
    const OdometryResult result = odometry.update(features);
    ASSERT_TRUE(result.registered);
    EXPECT_LT(result.motion->T_now_before.translation().norm(), 1e-6);
    EXPECT_EQ(result.inliers, features.size());
  }
}

TEST_F(OdometryTest, LeavesOutFramesThatSeeNothingKnownAndGoesOnAfterwards) {
  odometry.setStart(World::poseAt(0.0));
  for (int i = 0; i < 5; ++i) odometry.update(world.see(World::poseAt(0.1 * i)));
  const std::size_t landmarks = odometry.landmarks();
  for (int i = 0; i < 3; ++i) {
    const OdometryResult elsewhere = odometry.update(world.see(World::poseAt(28.0)));
    EXPECT_FALSE(elsewhere.registered);
    EXPECT_NE(elsewhere.reason.find("known from earlier frames"), std::string::npos);
    EXPECT_EQ(odometry.landmarks(), landmarks);
  }
  const OdometryResult empty = odometry.update({});
  EXPECT_FALSE(empty.registered);
  EXPECT_FALSE(empty.reason.empty());
  const Pose back = World::poseAt(0.6);
  const OdometryResult result = odometry.update(world.see(back));
  ASSERT_TRUE(result.registered) << result.reason;
  EXPECT_LT(positionError(result.T_world_sensor, back), 0.05);
  // The motion is that since the last frame that was registered.
  EXPECT_NEAR(result.motion->T_now_before.translation().norm(), 0.2, 0.05);
}

TEST(OdometryFaults, SurvivesWrongMatches) {
  for (const double fraction : {0.05, 0.1, 0.2}) {
    World world;
    Odometry odometry(worldParams());
    odometry.setStart(World::poseAt(0.0));
    OdometryResult result;
    Pose truth;
    for (int i = 0; i <= 40; ++i) {
      truth = World::poseAt(0.1 * i);
      auto features = world.see(truth);
      world.confuse(features, fraction);
      result = odometry.update(features);
      ASSERT_TRUE(result.registered) << fraction << " " << i << ": " << result.reason;
    }
    EXPECT_LT(positionError(result.T_world_sensor, truth), 0.06) << fraction;
  }
}

TEST(OdometryFaults, FeaturesOfAnotherWorldAreNoMotion) {
  World world(1);
  World other(2);
  Odometry odometry(worldParams());
  odometry.update(world.see(World::poseAt(0.0)));
  const OdometryResult result = odometry.update(other.see(World::poseAt(0.0)));
  EXPECT_FALSE(result.registered);
  EXPECT_NE(result.reason.find("agree on a motion"), std::string::npos) << result.reason;
}

TEST_F(OdometryTest, UnusableFeaturesAreLeftOut) {
  const auto first = world.see(World::poseAt(0.0));
  odometry.update(first);
  auto features = world.see(World::poseAt(0.1));
  features[0].position = Vector3(test::kNan, 0, 1);
  features[1].position = Vector3(0, 0, -1);
  features[2].position = Vector3(1e12, 0, 1e12);
  features[4].track = features[3].track;  // one track in two places
  const OdometryResult result = odometry.update(features);
  ASSERT_TRUE(result.registered);
  EXPECT_EQ(result.features, features.size() - 5);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(result.is_inlier[static_cast<std::size_t>(i)], 0);
}

TEST_F(OdometryTest, RefusesWhatIsWrongAndStaysAsItWas) {
  auto features = world.see(World::poseAt(0.0));
  odometry.update(features);
  features[0].track = -1;
  EXPECT_THROW(odometry.update(features), InputError);
  PosePrior given;
  given.T_world_sensor.translation().x() = test::kNan;
  EXPECT_THROW(odometry.update(world.see(World::poseAt(0.0)), given), InputError);
  EXPECT_THROW(odometry.setStart(given.T_world_sensor), InputError);
  EXPECT_TRUE(odometry.update(world.see(World::poseAt(0.1))).registered);
}

TEST(OdometryFaults, RefusesBadParameters) {
  const auto refused = [](auto change) {
    OdometryParams params;
    change(params);
    EXPECT_THROW(Odometry{params}, ParameterError);
  };
  refused([](OdometryParams& p) { p.keyframe_translation = 0.0; });
  refused([](OdometryParams& p) { p.keyframe_rotation = test::kNan; });
  refused([](OdometryParams& p) { p.max_landmarks = 1; });
  refused([](OdometryParams& p) { p.jump_distance = 0.0; });
  refused([](OdometryParams& p) { p.jump_inlier_fraction = 2.0; });
  refused([](OdometryParams& p) { p.camera.fx = -1.0; });
  refused([](OdometryParams& p) { p.motion.min_matches = 0; });
}

TEST(OdometryFaults, TooFewFeaturesDoNotStart) {
  Odometry odometry(worldParams());
  const OdometryResult result = odometry.update({});
  EXPECT_FALSE(result.registered);
  EXPECT_NE(result.reason.find("to start from"), std::string::npos);
  EXPECT_FALSE(odometry.started());
}

}  // namespace
}  // namespace planar_mapping
