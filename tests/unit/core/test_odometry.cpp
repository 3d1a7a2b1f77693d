// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/odometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/core/error.h"

namespace planar_mapping {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Landmarks on the walls of a corridor along x, and a camera that looks along it.
class World {
 public:
  explicit World(std::uint64_t seed = 1) : random_(seed) {
    for (int i = 0; i < 3000; ++i) {
      const double x = random_.uniform(0.0, 40.0);
      const double side = random_.uniform(0.0, 3.0);
      if (side < 1.0) {
        points_.emplace_back(x, 1.2, random_.uniform(0.0, 2.2));
      } else if (side < 2.0) {
        points_.emplace_back(x, -1.2, random_.uniform(0.0, 2.2));
      } else {
        points_.emplace_back(x, random_.uniform(-1.2, 1.2), 2.2);
      }
    }
  }

  static FeatureCamera camera() {
    FeatureCamera camera = FeatureCamera::stereo(500.0, 500.0, 320.0, 240.0, 0.12, 0.3);
    camera.pixel_error = 0.3;
    return camera;
  }

  static Pose poseAt(double x, double y = 0.0, double yaw = 0.0) {
    Pose pose = Pose::Identity();
    Matrix3 axes;  // optical axes, looking along x
    axes << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
    pose.linear() = Eigen::AngleAxisd(yaw, Vector3::UnitZ()).toRotationMatrix() * axes;
    pose.translation() << x, y, 0.9;
    return pose;
  }

  /// What the camera sees from there: the nearest 200 points in view, with noise.
  std::vector<KeyFeature> see(const Pose& T_world_sensor, double noise = 1.0) {
    const FeatureCamera model = camera();
    std::vector<std::pair<double, KeyFeature>> seen;
    const Pose T_sensor_world = T_world_sensor.inverse();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vector3 p = T_sensor_world * points_[i];
      if (p.z() < 0.5 || p.z() > 12.0) continue;
      FeatureSighting s = project(model, p);
      if (s.column < 0.0 || s.column > 639.0 || s.row < 0.0 || s.row > 479.0) continue;
      const Vector3 deviation = sightingVariance(model, s.inverse_depth).cwiseSqrt();
      s.column += noise * deviation.x() * random_.normal();
      s.row += noise * deviation.y() * random_.normal();
      s.inverse_depth += noise * deviation.z() * random_.normal();
      KeyFeature feature;
      feature.track = static_cast<std::int64_t>(i);
      feature.column = static_cast<float>(s.column);
      feature.row = static_cast<float>(s.row);
      feature.position = backProject(model, s);
      seen.push_back({p.z(), feature});
    }
    std::sort(seen.begin(), seen.end(),
              [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<KeyFeature> features;
    for (std::size_t i = 0; i < std::min<std::size_t>(200, seen.size()); ++i) {
      features.push_back(seen[i].second);
    }
    return features;
  }

  /// Gives a share of the features the track of another one.
  void confuse(std::vector<KeyFeature>& features, double share) {
    for (KeyFeature& feature : features) {
      if (random_.uniform() >= share) continue;
      const auto other = random_.below(static_cast<std::uint32_t>(features.size()));
      std::swap(feature.track, features[other].track);
    }
  }

 private:
  Random random_;
  std::vector<Vector3> points_;
};

OdometryParams worldParams() {
  OdometryParams params;
  params.camera = World::camera();
  return params;
}

double positionError(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).norm();
}

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
  EXPECT_LE(odometry.keyframes(), 20u);
}

TEST(Odometry, LargeStepsWorkWithAndWithoutBundleAdjustment) {
  for (const int window : {0, 1, 8, 100}) {
    World world;
    OdometryParams params = worldParams();
    params.window = window;
    Odometry odometry(params);
    odometry.setStart(World::poseAt(0.0));
    for (int i = 0; i <= 12; ++i) {
      const Pose truth = World::poseAt(1.0 * i);
      const OdometryResult result = odometry.update(world.see(truth));
      ASSERT_TRUE(result.registered) << window << " " << i << ": " << result.reason;
      EXPECT_LT(positionError(result.T_world_sensor, truth), 0.01 + 0.005 * i) << window;
    }
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
  EXPECT_EQ(odometry.keyframes(), 1u);
  EXPECT_EQ(odometry.landmarks(), landmarks);
  EXPECT_LT(positionError(result.T_world_sensor, World::poseAt(0.0)), 0.02);
}

TEST(Odometry, FrozenImagesAreNoMotion) {
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

TEST(Odometry, LeavesOutFramesThatSeeNothingKnownAndGoesOnAfterwards) {
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

TEST(Odometry, SurvivesWrongMatches) {
  for (const double share : {0.05, 0.1, 0.2}) {
    World world;
    Odometry odometry(worldParams());
    odometry.setStart(World::poseAt(0.0));
    OdometryResult result;
    Pose truth;
    for (int i = 0; i <= 40; ++i) {
      truth = World::poseAt(0.1 * i);
      auto features = world.see(truth);
      world.confuse(features, share);
      result = odometry.update(features);
      ASSERT_TRUE(result.registered) << share << " " << i << ": " << result.reason;
    }
    EXPECT_LT(positionError(result.T_world_sensor, truth), 0.06) << share;
  }
}

TEST(Odometry, FeaturesOfAnotherWorldAreNoMotion) {
  World world(1);
  World other(2);
  Odometry odometry(worldParams());
  odometry.update(world.see(World::poseAt(0.0)));
  const OdometryResult result = odometry.update(other.see(World::poseAt(0.0)));
  EXPECT_FALSE(result.registered);
  EXPECT_NE(result.reason.find("agree on a motion"), std::string::npos) << result.reason;
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

TEST(Odometry, MemoryIsBounded) {
  World world;
  OdometryParams params = worldParams();
  params.max_landmarks = 400;
  params.max_keyframes = 4;
  Odometry odometry(params);
  odometry.setStart(World::poseAt(0.0));
  OdometryResult result;
  for (int i = 0; i <= 50; ++i) {
    result = odometry.update(world.see(World::poseAt(0.4 * i)));
    ASSERT_TRUE(result.registered) << i << result.reason;
    EXPECT_LE(odometry.keyframes(), 4u);
    EXPECT_LE(odometry.landmarks(), 1300u);  // 400, those of four keyframes and of the frame
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

TEST(Odometry, UnusableFeaturesAreLeftOut) {
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

TEST(Odometry, RefusesWhatIsWrongAndStaysAsItWas) {
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

TEST(Odometry, RefusesBadParameters) {
  const auto refused = [](auto change) {
    OdometryParams params;
    change(params);
    EXPECT_THROW(Odometry{params}, ParameterError);
  };
  refused([](OdometryParams& p) { p.keyframe_translation = 0.0; });
  refused([](OdometryParams& p) { p.keyframe_rotation = kNan; });
  refused([](OdometryParams& p) { p.keyframe_overlap = 2.0; });
  refused([](OdometryParams& p) { p.max_keyframes = 0; });
  refused([](OdometryParams& p) { p.window = -1; });
  refused([](OdometryParams& p) { p.adjustment_iterations = 0; });
  refused([](OdometryParams& p) { p.max_landmarks = 1; });
  refused([](OdometryParams& p) { p.jump_distance = 0.0; });
  refused([](OdometryParams& p) { p.jump_inlier_share = 2.0; });
  refused([](OdometryParams& p) { p.camera.fx = -1.0; });
  refused([](OdometryParams& p) { p.motion.min_matches = 0; });
}

TEST(Odometry, TooFewFeaturesDoNotStart) {
  Odometry odometry(worldParams());
  const OdometryResult result = odometry.update({});
  EXPECT_FALSE(result.registered);
  EXPECT_NE(result.reason.find("to start from"), std::string::npos);
  EXPECT_FALSE(odometry.started());
}

}  // namespace
}  // namespace planar_mapping
