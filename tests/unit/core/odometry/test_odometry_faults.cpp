// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Odometry on features that are wrong, unknown or unusable, and on bad parameters.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "feature_corridor.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/odometry/odometry.h"

namespace planar_mapping {
namespace {

using test::positionError;
using test::worldParams;
using World = test::FeatureCorridor;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(OdometryFaults, FrozenImagesAreNoMotion) {
  World world;
  Odometry odometry(worldParams());
  const auto features = world.see(World::poseAt(0.0));
  odometry.update(features);
  for (int i = 0; i < 3; ++i) {
    const OdometryResult result = odometry.update(features);
    ASSERT_TRUE(result.registered);
    EXPECT_LT(result.motion->T_now_before.translation().norm(), 1e-6);
    EXPECT_EQ(result.inliers, features.size());
  }
}

TEST(OdometryFaults, LeavesOutFramesThatSeeNothingKnownAndGoesOnAfterwards) {
  World world;
  Odometry odometry(worldParams());
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

TEST(OdometryFaults, UnusableFeaturesAreLeftOut) {
  World world;
  Odometry odometry(worldParams());
  const auto first = world.see(World::poseAt(0.0));
  odometry.update(first);
  auto features = world.see(World::poseAt(0.1));
  features[0].position = Vector3(kNan, 0, 1);
  features[1].position = Vector3(0, 0, -1);
  features[2].position = Vector3(1e12, 0, 1e12);
  features[4].track = features[3].track;  // one track in two places
  const OdometryResult result = odometry.update(features);
  ASSERT_TRUE(result.registered);
  EXPECT_EQ(result.features, features.size() - 5);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(result.is_inlier[static_cast<std::size_t>(i)], 0);
}

TEST(OdometryFaults, RefusesWhatIsWrongAndStaysAsItWas) {
  World world;
  Odometry odometry(worldParams());
  auto features = world.see(World::poseAt(0.0));
  odometry.update(features);
  features[0].track = -1;
  EXPECT_THROW(odometry.update(features), InputError);
  PosePrior given;
  given.T_world_sensor.translation().x() = kNan;
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
  refused([](OdometryParams& p) { p.keyframe_rotation = kNan; });
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
