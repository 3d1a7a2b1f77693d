// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "numbers.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/beliefs/feature_beliefs.h"
#include "planar_mapping/beliefs/occupancy.h"

namespace planar_mapping {
namespace {

PointsView viewOf(const std::vector<float>& xyz) {
  return {xyz.data(), xyz.size() / 3};
}

// B = 0.12 m, f = 500 px, dd = 0.5 px: dz = z^2 / 120.
TEST(Occupancy, DepthErrorMatchesHandWorkedValues) {
  const StereoNoise noise;
  EXPECT_NEAR(noise.depthError(2.0), 0.033333, 1e-6);
  EXPECT_NEAR(noise.depthError(3.0), 0.075, 1e-12);
  // rbar = 2.5, z = 2: dr = 2.5 / 2 * dz.
  EXPECT_NEAR(rangeError(2.5, 2.0, noise), 0.0416667, 1e-6);
  EXPECT_EQ(rangeError(2.5, 0.0, noise), 0.0);
}

TEST(Occupancy, FeatureProbabilityMatchesHandWorkedValues) {
  EXPECT_DOUBLE_EQ(featureProbability(2.0, 2.0, 0.1), 1.0);
  EXPECT_NEAR(featureProbability(2.1, 2.0, 0.1), 0.60653, 1e-5);  // one deviation: exp(-1/2)
  EXPECT_NEAR(featureProbability(1.8, 2.0, 0.1), 0.13534, 1e-5);  // two: exp(-2)
  EXPECT_NEAR(featureProbability(2.1, 2.0, 0.1, 0.5), 0.30327, 1e-5);
  EXPECT_EQ(featureProbability(2.1, 2.0, 0.0), 0.0);
  EXPECT_EQ(featureProbability(2.0, 2.0, 0.0), 1.0);
}

// Two features on the optical axis at 2.0 m and 2.1 m: rbar = 2.05,
// dr_1 = 2.05 * 2.0 / 120 = 0.0341667, dr_2 = 2.05 * 2.1 / 120 = 0.035875.
TEST(Occupancy, GroupOfTwoMatchesHandWorkedValues) {
  const std::vector<float> xyz{0, 0, 2.0f, 0, 0, 2.1f};
  const auto p = featureProbabilities(viewOf(xyz), nullptr, {7, 7}, OccupancyParams());
  ASSERT_EQ(p.size(), 2u);
  EXPECT_NEAR(p[0], std::exp(-0.5 * std::pow(0.05 / 0.0341667, 2)), 1e-4);
  EXPECT_NEAR(p[1], std::exp(-0.5 * std::pow(0.05 / 0.035875, 2)), 1e-4);
}

TEST(Occupancy, GroupsDoNotInfluenceEachOther) {
  const std::vector<float> xyz{0, 0, 2.0f, 0, 0, 2.1f, 0, 0, 5.0f, 0, 0, 5.2f};
  const auto both = featureProbabilities(viewOf(xyz), nullptr, {0, 0, 1, 1}, OccupancyParams());
  const Indices first{0, 1};
  const auto alone = featureProbabilities(viewOf(xyz), &first, {0, 0}, OccupancyParams());
  EXPECT_EQ(both[0], alone[0]);
  EXPECT_EQ(both[1], alone[1]);
}

TEST(Occupancy, GroupNumbersDoNotMatter) {
  const std::vector<float> xyz{0, 0, 2.0f, 0, 0, 2.1f, 0, 0, 5.0f, 0, 0, 5.2f};
  const auto small = featureProbabilities(viewOf(xyz), nullptr, {0, 0, 1, 1}, OccupancyParams());
  const auto large =
      featureProbabilities(viewOf(xyz), nullptr, {2147483647, 2147483647, 5, 5}, OccupancyParams());
  EXPECT_EQ(small, large);
}

TEST(Occupancy, LonelyFeatureGetsItsOwnProbability) {
  const std::vector<float> xyz{0, 0, 2, 0, 0, 3, 0, 0, 4};
  OccupancyParams params;
  params.single_feature_probability = 0.3;
  const auto p = featureProbabilities(viewOf(xyz), nullptr, {0, -1, -1}, params);
  for (const float value : p) EXPECT_FLOAT_EQ(value, 0.3f);
}

TEST(Occupancy, NonFiniteFeaturesDoNotCount) {
  const std::vector<float> xyz{0, 0, 2.0f, 0, 0, 2.1f, test::kNanFloat, 0, 3, 0, INFINITY, 1};
  const auto p = featureProbabilities(viewOf(xyz), nullptr, {0, 0, 0, 0}, OccupancyParams());
  const Indices finite{0, 1};
  const auto alone = featureProbabilities(viewOf(xyz), &finite, {0, 0}, OccupancyParams());
  EXPECT_EQ(p[0], alone[0]);
  EXPECT_EQ(p[2], 0.0f);
  EXPECT_EQ(p[3], 0.0f);
}

TEST(Occupancy, RangeErrorFloorForgivesTheSizeOfTheCell) {
  const std::vector<float> xyz{0, 0, 0.50f, 0, 0, 0.56f};
  OccupancyParams params;
  const auto paper = featureProbabilities(viewOf(xyz), nullptr, {0, 0}, params);
  params.min_range_error = 0.05;
  const auto floor = featureProbabilities(viewOf(xyz), nullptr, {0, 0}, params);
  EXPECT_LT(paper[0], 1e-6);
  EXPECT_NEAR(floor[0], std::exp(-0.5 * 0.36), 1e-3);
}

TEST(Occupancy, StaysInRangeForHostileInput) {
  Random random(1);
  std::vector<float> xyz;
  std::vector<std::int32_t> groups;
  for (int i = 0; i < 2000; ++i) {
    const float scale = i % 3 == 0 ? 1e9f : (i % 3 == 1 ? 3e38f : 1e-30f);
    for (int k = 0; k < 3; ++k) xyz.push_back(scale * static_cast<float>(random.uniform(-1, 1)));
    groups.push_back(static_cast<std::int32_t>(random.below(20)) - 1);
  }
  for (const float p : featureProbabilities(viewOf(xyz), nullptr, groups, OccupancyParams())) {
    ASSERT_GE(p, 0.0f);
    ASSERT_LE(p, 1.0f);
  }
}

TEST(Occupancy, DepthFollowsTheOpticalAxis) {
  EXPECT_DOUBLE_EQ(depthOf({3, 4, 12}, Vector3::UnitZ()), 12.0);
  EXPECT_DOUBLE_EQ(depthOf({3, 4, 12}, Vector3(2, 0, 0)), 3.0);
  EXPECT_DOUBLE_EQ(depthOf({3, 4, 12}, Vector3::Zero()), 13.0);
}

TEST(Occupancy, RejectsBadArguments) {
  const std::vector<float> xyz{0, 0, 2};
  const Indices outside{1};
  EXPECT_THROW(featureProbabilities(viewOf(xyz), &outside, {0}, OccupancyParams()), InputError);
  EXPECT_THROW(featureProbabilities(viewOf(xyz), nullptr, {0, 1}, OccupancyParams()), InputError);
  OccupancyParams params;
  params.noise.baseline = 0.0;
  EXPECT_THROW(featureProbabilities(viewOf(xyz), nullptr, {0}, params), ParameterError);
  params = OccupancyParams();
  params.eta1 = test::kNanFloat;
  EXPECT_THROW(params.validate(), ParameterError);
  EXPECT_THROW(featureProbability(test::kNanFloat, 1, 1), ParameterError);
  EXPECT_THROW(rangeError(1, -1, StereoNoise()), ParameterError);
}

TEST(Occupancy, AcceptsNoFeatures) {
  EXPECT_TRUE(featureProbabilities(PointsView(), nullptr, {}, OccupancyParams()).empty());
}

using Observation = FeatureBeliefs::Observation;

const std::optional<FrameMotion> kStill = FrameMotion();

TEST(FeatureBeliefs, StartFromTheProbabilityAndFollowTheUpdate) {
  FeatureBeliefs beliefs;
  EXPECT_EQ(beliefs.update({{5, {0, 0, 2}, 0.9}}).created, 1u);
  EXPECT_DOUBLE_EQ(*beliefs.belief(5), 0.9);
  EXPECT_FALSE(beliefs.belief(6).has_value());
  EXPECT_EQ(beliefs.update({{5, {0, 0, 2}, 0.5}}, kStill).updated, 1u);
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

}  // namespace
}  // namespace planar_mapping
