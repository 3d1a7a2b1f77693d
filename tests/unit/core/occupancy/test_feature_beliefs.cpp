// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/feature_beliefs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/base/detail/random.h"

namespace planar_mapping {
namespace {

using Observation = FeatureBeliefs::Observation;

const std::optional<FrameMotion> kStill = FrameMotion();

TEST(FeatureBeliefs, NewFeatureStartsFromItsProbability) {
  FeatureBeliefs beliefs;
  const auto summary = beliefs.update({{5, {0, 0, 2}, 0.7}});
  EXPECT_EQ(summary.created, 1u);
  EXPECT_DOUBLE_EQ(*beliefs.belief(5), 0.7);
  EXPECT_FALSE(beliefs.belief(6).has_value());
}

TEST(FeatureBeliefs, SeenAgainFollowsTheUpdate) {
  FeatureBeliefs beliefs;
  beliefs.update({{5, {0, 0, 2}, 0.9}});
  const auto summary = beliefs.update({{5, {0, 0, 2}, 0.5}}, kStill);
  EXPECT_EQ(summary.updated, 1u);
  EXPECT_NEAR(*beliefs.belief(5), 0.58919, 1e-5);  // Eq. 10 with p = 0.9, q = 0.5
}

TEST(FeatureBeliefs, UnseenFeatureKeepsItsBelief) {
  FeatureBeliefs beliefs;
  beliefs.update({{5, {0, 0, 2}, 0.9}, {6, {0, 1, 2}, 0.8}});
  for (int i = 0; i < 20; ++i) {
    const auto summary = beliefs.update({{6, {0, 1, 2}, 0.8}}, kStill);
    EXPECT_EQ(summary.unseen, 1u);
  }
  EXPECT_DOUBLE_EQ(*beliefs.belief(5), 0.9);
}

TEST(FeatureBeliefs, ForgetsAfterTheFramesAskedFor) {
  FeatureBeliefParams params;
  params.max_unseen_frames = 2;
  FeatureBeliefs beliefs(params);
  beliefs.update({{5, {0, 0, 2}, 0.9}});
  EXPECT_EQ(beliefs.update({}, kStill).forgotten, 0u);
  EXPECT_EQ(beliefs.update({}, kStill).forgotten, 0u);
  EXPECT_EQ(beliefs.update({}, kStill).forgotten, 1u);
  EXPECT_EQ(beliefs.size(), 0u);
}

TEST(FeatureBeliefs, FeatureThatMovesLosesBelief) {
  FrameMotion motion;
  motion.T_now_before.translation() = Vector3(0, 0, -0.5);
  FeatureBeliefs beliefs;
  beliefs.update({{1, {0, 0, 3}, 0.9}, {2, {1, 0, 3}, 0.9}});
  beliefs.update({{1, {0, 0, 2.5}, 0.9}, {2, {1.3, 0, 2.5}, 0.9}}, motion);
  EXPECT_NEAR(*beliefs.belief(1), 1.0, 1e-9);  // where the motion carries it
  EXPECT_LT(*beliefs.belief(2), 0.01);         // 30 cm off sideways
}

TEST(FeatureBeliefs, MotionIsChainedOverFramesWithoutASighting) {
  FrameMotion step;
  step.T_now_before.linear() = Eigen::AngleAxisd(0.1, Vector3::UnitY()).toRotationMatrix();
  step.T_now_before.translation() = Vector3(0.05, 0, -0.1);
  const Vector3 start(0.4, -0.2, 3.0);
  FeatureBeliefs beliefs;
  beliefs.update({{1, start, 0.9}});
  beliefs.update({}, step);
  beliefs.update({}, step);
  const Vector3 now = step.T_now_before * (step.T_now_before * (step.T_now_before * start));
  beliefs.update({{1, now, 0.9}}, step);
  EXPECT_NEAR(*beliefs.belief(1), 1.0, 1e-6);
}

TEST(FeatureBeliefs, UnknownMotionIsNotHeldAgainstAFeature) {
  FeatureBeliefs beliefs;
  beliefs.update({{1, {0, 0, 3}, 0.9}});
  beliefs.update({{1, {2, 0, 3}, 0.9}});
  EXPECT_NEAR(*beliefs.belief(1), 1.0, 1e-9);
}

TEST(FeatureBeliefs, PoseReadingComparesPredictedAndMeasuredMotion) {
  FeatureBeliefParams params;
  params.motion_reading = MotionReading::RobotPose;
  FrameMotion motion;
  motion.covariance = Matrix6::Identity() * 0.01;
  motion.predicted = Pose::Identity();
  motion.predicted->translation().x() = 0.1;  // one deviation: factor exp(-1/2)
  FeatureBeliefs beliefs(params);
  beliefs.update({{1, {0, 0, 3}, 0.9}});
  beliefs.update({{1, {2, 0, 3}, 0.9}}, motion);
  // q = 0.9 exp(-1/2), D = 0.9 * ln(p / q) = 0.9 * 0.5
  EXPECT_NEAR(*beliefs.belief(1), std::exp(-0.45), 1e-9);
}

TEST(FeatureBeliefs, OrderOfFeaturesDoesNotMatter) {
  Random random(2);
  FeatureBeliefs forwards;
  FeatureBeliefs backwards;
  for (int frame = 0; frame < 5; ++frame) {
    std::vector<Observation> seen;
    for (int i = 0; i < 200; ++i) {
      seen.push_back({static_cast<std::int64_t>(random.below(80)),
                      {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1, 4)},
                      random.uniform()});
    }
    forwards.update(seen, kStill);
    std::reverse(seen.begin(), seen.end());
    backwards.update(seen, kStill);
  }
  ASSERT_EQ(forwards.tracks(), backwards.tracks());
  for (const std::int64_t track : forwards.tracks()) {
    EXPECT_EQ(*forwards.belief(track), *backwards.belief(track));
    EXPECT_GE(*forwards.belief(track), 0.0);
    EXPECT_LE(*forwards.belief(track), 1.0);
  }
}

TEST(FeatureBeliefs, RepeatedTrackCountsOnceWithItsMean) {
  FeatureBeliefs beliefs;
  beliefs.update({{1, {0, 0, 2}, 0.2}, {1, {0, 0, 2}, 0.6}});
  EXPECT_DOUBLE_EQ(*beliefs.belief(1), 0.4);
}

TEST(FeatureBeliefs, BadFrameChangesNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  FeatureBeliefs beliefs;
  beliefs.update({{1, {0, 0, 2}, 0.9}});
  EXPECT_THROW(beliefs.update({{1, {0, 0, 2}, 0.1}, {-1, {0, 0, 2}, 0.5}}), InputError);
  EXPECT_THROW(beliefs.update({{1, {0, 0, 2}, 0.1}, {2, {0, nan, 2}, 0.5}}), ParameterError);
  EXPECT_THROW(beliefs.update({{1, {0, 0, 2}, 0.1}, {2, {0, 0, 2}, nan}}), ParameterError);
  FrameMotion motion;
  motion.covariance(0, 0) = -1.0;
  EXPECT_THROW(beliefs.update({{1, {0, 0, 2}, 0.1}}, motion), ParameterError);
  motion = FrameMotion();
  motion.T_now_before.translation().x() = nan;
  EXPECT_THROW(beliefs.update({{1, {0, 0, 2}, 0.1}}, motion), InputError);
  EXPECT_EQ(beliefs.frames(), 1u);
  EXPECT_EQ(beliefs.size(), 1u);
  EXPECT_DOUBLE_EQ(*beliefs.belief(1), 0.9);
}

TEST(FeatureBeliefs, LongRunsKeepTheCovarianceUsable) {
  FrameMotion motion;
  motion.covariance = Matrix6::Identity() * 1e4;
  FeatureBeliefs beliefs;
  for (int i = 0; i < 2000; ++i) beliefs.update({}, motion);
  motion.covariance = Matrix6::Identity() * 1e-6;
  beliefs.update({{1, {0, 0, 2}, 0.9}}, motion);
  EXPECT_NO_THROW(beliefs.update({{1, {0, 0, 2}, 0.9}}, motion));
  EXPECT_NEAR(*beliefs.belief(1), 1.0, 1e-6);
}

TEST(FeatureBeliefs, ClearForgetsEverythingButTheParameters) {
  FeatureBeliefParams params;
  params.max_unseen_frames = 7;
  FeatureBeliefs beliefs(params);
  beliefs.update({{1, {0, 0, 2}, 0.9}});
  beliefs.clear();
  EXPECT_EQ(beliefs.size(), 0u);
  EXPECT_EQ(beliefs.frames(), 0u);
  EXPECT_EQ(beliefs.params().max_unseen_frames, 7);
}

TEST(FeatureBeliefs, CopiesAreIndependent) {
  FeatureBeliefs original;
  original.update({{1, {0, 0, 2}, 0.9}});
  FeatureBeliefs copy = original;
  copy.update({{1, {0, 0, 2}, 0.1}}, kStill);
  EXPECT_DOUBLE_EQ(*original.belief(1), 0.9);
}

}  // namespace
}  // namespace planar_mapping
