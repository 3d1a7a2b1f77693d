// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/beliefs/belief_update.h"
#include "planar_mapping/beliefs/feature_beliefs.h"
#include "planar_mapping/beliefs/occupancy.h"

namespace planar_mapping {
namespace {

BeliefUpdateParams with(UpdateRule rule) {
  BeliefUpdateParams params;
  params.rule = rule;
  return params;
}

TEST(BeliefUpdate, TheRuleOfThePaperIsEquation10) {
  const BeliefUpdateParams params;
  EXPECT_EQ(params.rule, UpdateRule::KullbackLeibler);
  EXPECT_DOUBLE_EQ(firstBelief(0.9, params), 0.9);
  // p = 0.9, q = 1 * 0.5: exp(-0.9 ln 1.8)
  EXPECT_NEAR(nextBelief(0.9, 1.0, 0.5, params), 0.5892, 1e-4);
  EXPECT_NEAR(nextBelief(0.9, 0.5, 1.0, params), 0.5892, 1e-4);
  EXPECT_NEAR(nextBelief(0.5, 0.5, 1.0, params), std::exp(-1.07), 1e-9);
}

// Odds by hand: a hit of 0.7 multiplies them by 7/3, a miss of 0.4 by 2/3.
TEST(BeliefUpdate, LogOddsCountsHitsAndMisses) {
  const BeliefUpdateParams params = with(UpdateRule::LogOdds);
  EXPECT_NEAR(firstBelief(0.9, params), 0.7, 1e-12);
  EXPECT_NEAR(firstBelief(0.3, params), 0.4, 1e-12);
  EXPECT_NEAR(nextBelief(0.7, 0.9, 1.0, params), 49.0 / 58.0, 1e-12);
  // A good feature where the motion does not let it be is a miss.
  EXPECT_NEAR(nextBelief(0.7, 0.9, 0.1, params), 14.0 / 23.0, 1e-12);
}

TEST(BeliefUpdate, NoneForgetsWhatWas) {
  const BeliefUpdateParams params = with(UpdateRule::None);
  EXPECT_DOUBLE_EQ(firstBelief(0.3, params), 0.3);
  EXPECT_DOUBLE_EQ(nextBelief(0.9, 0.3, 0.0, params), 0.3);
}

TEST(BeliefUpdate, FeaturesFollowTheRuleChosen) {
  FeatureBeliefParams params;
  params.update = with(UpdateRule::LogOdds);
  FeatureBeliefs beliefs(params);
  beliefs.update({{1, {0, 0, 2}, 0.9}});
  beliefs.update({{1, {0, 0, 2}, 0.9}});
  EXPECT_NEAR(*beliefs.belief(1), 49.0 / 58.0, 1e-12);
  params.update.log_odds.miss = 0.6;
  EXPECT_THROW(beliefs.setParams(params), ParameterError);
}

TEST(BeliefUpdate, RejectsBadValues) {
  const double nan = std::nan("");
  for (const UpdateRule rule :
       {UpdateRule::KullbackLeibler, UpdateRule::LogOdds, UpdateRule::None}) {
    EXPECT_THROW(firstBelief(nan, with(rule)), ParameterError);
    EXPECT_THROW(nextBelief(0.5, 1.1, 1.0, with(rule)), ParameterError);
    EXPECT_THROW(nextBelief(0.5, 0.5, nan, with(rule)), ParameterError);
  }
  EXPECT_THROW(nextBelief(-0.1, 0.5, 1.0), ParameterError);
}

TEST(LogOdds, IsTheLogarithmOfTheOdds) {
  EXPECT_DOUBLE_EQ(logOdds(0.5), 0.0);
  EXPECT_NEAR(logOdds(0.8), std::log(4.0), 1e-12);
  EXPECT_NEAR(logOdds(0.2), -std::log(4.0), 1e-12);
  EXPECT_NEAR(probabilityOfLogOdds(std::log(4.0)), 0.8, 1e-12);
  EXPECT_DOUBLE_EQ(probabilityOfLogOdds(std::numeric_limits<double>::infinity()), 1.0);
  EXPECT_DOUBLE_EQ(probabilityOfLogOdds(-std::numeric_limits<double>::infinity()), 0.0);
}

TEST(LogOdds, ThePriorIsTakenOff) {
  LogOddsParams params;
  params.prior = 0.4;  // odds 2/3: a hit multiplies by (7/3) / (2/3) = 7/2
  EXPECT_NEAR(logOddsUpdate(0.5, true, params), 7.0 / 9.0, 1e-12);
}

TEST(LogOdds, StaysBetweenTheClamps) {
  double belief = 0.5;
  for (int i = 0; i < 100; ++i) belief = logOddsUpdate(belief, true);
  EXPECT_DOUBLE_EQ(belief, 0.971);
  // Odds 33.48 at the upper clamp: (3/2)^8 = 25.6 is less, (3/2)^9 = 38.4 is more.
  int misses = 0;
  for (; belief >= 0.5; ++misses) belief = logOddsUpdate(belief, false);
  EXPECT_EQ(misses, 9);
  for (int i = 0; i < 100; ++i) belief = logOddsUpdate(belief, false);
  EXPECT_DOUBLE_EQ(belief, 0.1192);
  EXPECT_GT(logOddsUpdate(0.0, true), 0.1192);
  EXPECT_LT(logOddsUpdate(1.0, false), 0.971);
}

TEST(LogOdds, RejectsBadValues) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, 0.0, 1.0, -0.1, 1.1}) EXPECT_THROW(logOdds(bad), ParameterError);
  EXPECT_THROW(probabilityOfLogOdds(nan), ParameterError);
  for (const double bad : {nan, -0.1, 1.1}) EXPECT_THROW(logOddsUpdate(bad, true), ParameterError);
  const auto rejects = [](auto&& spoil) {
    LogOddsParams params;
    spoil(params);
    EXPECT_THROW(params.validate(), ParameterError);
  };
  rejects([](LogOddsParams& p) { p.prior = 0.0; });
  rejects([](LogOddsParams& p) { p.hit = 0.5; });
  rejects([](LogOddsParams& p) { p.miss = 0.5; });
  rejects([](LogOddsParams& p) { p.min_probability = 0.5; });
  rejects([](LogOddsParams& p) { p.max_probability = 1.0; });
  rejects([&](LogOddsParams& p) { p.hit_threshold = nan; });
}

// Worked by hand from Eq. 10 with eta3 = 1, A = 1.07.
TEST(KlUpdate, MatchesHandWorkedValues) {
  EXPECT_NEAR(updatedBelief(0.9, 0.9), 1.0, 1e-12);
  EXPECT_NEAR(updatedBelief(0.5, 0.5), 0.34301, 1e-5);  // exp(-1.07)
  EXPECT_NEAR(updatedBelief(0.9, 0.5), 0.58919, 1e-5);  // 1.8^-0.9
  EXPECT_NEAR(updatedBelief(0.9, 0.1), 0.13842, 1e-5);  // 9^-0.9
  EXPECT_NEAR(updatedBelief(0.5, 0.9), 0.74536, 1e-5);  // (9/5)^-0.5
  EXPECT_NEAR(updatedBelief(0.2, 0.4), 0.29861, 1e-5);  // 2^-0.2 exp(-1.07)
  EXPECT_NEAR(updatedBelief(0.2, 0.8), 0.75786, 1e-5);  // 4^-0.2
}

TEST(KlUpdate, DivergenceIsOneTermOfTheSum) {
  EXPECT_NEAR(klDivergence(0.9, 0.5), 0.9 * std::log(1.8), 1e-12);
  EXPECT_NEAR(klDivergence(0.5, 0.9), -0.5 * std::log(1.8), 1e-12);
  EXPECT_EQ(klDivergence(0.3, 0.3), 0.0);
}

TEST(KlUpdate, BiasAppliesUpToAndIncludingOneHalf) {
  const double above = std::nextafter(0.5, 1.0);
  EXPECT_NEAR(updatedBelief(above, 0.5), 1.0, 1e-9);
  EXPECT_NEAR(updatedBelief(0.5, above), 1.0, 1e-9);
  EXPECT_NEAR(updatedBelief(0.5, 0.5), std::exp(-1.07), 1e-9);
}

TEST(KlUpdate, ObservedBeliefIsTheProductOfItsFactors) {
  KlUpdateParams params;
  params.eta2 = 0.5;
  EXPECT_DOUBLE_EQ(observedBelief(0.8, 0.25, params), 0.1);
  EXPECT_DOUBLE_EQ(observedBelief(0.8, 1.0), 0.8);
}

TEST(KlUpdate, GreaterDisagreementNeverGivesGreaterBelief) {
  for (double p = 0.55; p < 1.0; p += 0.05) {
    double before = 1.0;
    for (double q = p; q > 0.01; q -= 0.01) {
      const double belief = updatedBelief(p, q);
      EXPECT_LE(belief, before + 1e-12) << "p " << p << " q " << q;
      before = belief;
    }
  }
}

TEST(KlUpdate, StaysInRangeAtTheLimits) {
  Random random(3);
  for (int i = 0; i < 10000; ++i) {
    const double p = i < 4 ? i % 2 : random.uniform();
    const double q = i < 4 ? i / 2 : random.uniform();
    const double belief = updatedBelief(p, q);
    ASSERT_GE(belief, 0.0);
    ASSERT_LE(belief, 1.0);
    ASSERT_TRUE(std::isfinite(klDivergence(p, q)));
  }
}

TEST(KlUpdate, RejectsWhatIsNoProbability) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, -0.01, 1.01}) {
    EXPECT_THROW(updatedBelief(bad, 0.5), ParameterError);
    EXPECT_THROW(updatedBelief(0.5, bad), ParameterError);
    EXPECT_THROW(observedBelief(bad, 0.5), ParameterError);
    EXPECT_THROW(observedBelief(0.5, bad), ParameterError);
  }
  KlUpdateParams params;
  params.clamp = 0.5;
  EXPECT_THROW(params.validate(), ParameterError);
  params = KlUpdateParams();
  params.bias = -1.0;
  EXPECT_THROW(params.validate(), ParameterError);
  params = KlUpdateParams();
  params.eta3 = 1.5;
  EXPECT_THROW(params.validate(), ParameterError);
}

TEST(MotionFactor, MatchesHandWorkedValues) {
  const Matrix3 covariance = Vector3(0.01, 0.04, 0.09).asDiagonal();
  EXPECT_DOUBLE_EQ(motionFactor(Vector3(Vector3::Zero()), covariance), 1.0);
  EXPECT_NEAR(motionFactor(Vector3(0.1, 0, 0), covariance), 0.60653, 1e-5);
  EXPECT_NEAR(motionFactor(Vector3(0.1, 0.2, 0.3), covariance), std::exp(-1.5), 1e-9);
}

TEST(MotionFactor, DoesNotDependOnTheAxes) {
  const Matrix3 covariance = Vector3(0.01, 0.04, 0.09).asDiagonal();
  const Vector3 error(0.05, -0.1, 0.2);
  const Matrix3 R = Quaternion(0.9, 0.1, -0.3, 0.2).normalized().toRotationMatrix();
  EXPECT_NEAR(motionFactor(Vector3(R * error), R * covariance * R.transpose()),
              motionFactor(error, covariance), 1e-9);
}

TEST(MotionFactor, CertainDirectionsAllowNoError) {
  const Matrix3 covariance = Vector3(0.01, 0.0, 0.01).asDiagonal();
  EXPECT_NEAR(motionFactor(Vector3(0.1, 0, 0), covariance), 0.60653, 1e-5);
  EXPECT_EQ(motionFactor(Vector3(0.0, 0.1, 0), covariance), 0.0);
  EXPECT_EQ(motionFactor(Vector3(Vector3::Zero()), Matrix3::Zero()), 1.0);
}

TEST(MotionFactor, RejectsWhatIsNoCovariance) {
  const Matrix3 negative = Vector3(0.01, -0.01, 0.01).asDiagonal();
  EXPECT_THROW(motionFactor(Vector3(Vector3::Zero()), negative), ParameterError);
  Matrix3 broken = Matrix3::Identity();
  broken(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(motionFactor(Vector3(Vector3::Zero()), broken), ParameterError);
  EXPECT_THROW(motionFactor(Vector3(INFINITY, 0, 0), Matrix3::Identity()), ParameterError);
}

TEST(MotionFactor, PoseReadingComparesMeasuredWithPredictedMotion) {
  Matrix6 covariance = Matrix6::Identity() * 0.01;
  Pose measured = Pose::Identity();
  measured.translation() = Vector3(0.5, 0, 0);
  EXPECT_DOUBLE_EQ(poseMotionFactor(measured, measured, covariance), 1.0);
  Pose predicted = measured;
  predicted.translation().x() = 0.4;
  EXPECT_NEAR(poseMotionFactor(measured, predicted, covariance), 0.60653, 1e-5);
  predicted = measured;
  predicted.linear() = Eigen::AngleAxisd(0.1, Vector3::UnitY()).toRotationMatrix();
  EXPECT_NEAR(poseMotionFactor(measured, predicted, covariance), 0.60653, 1e-5);
}

// A feature straight ahead at z = 2: across the ray sigma = 2 / 500 * 0.5 = 2 mm, along it
// 2^2 / 60 * 0.5 = 33.3 mm.
TEST(MotionFactor, MeasurementCovarianceMatchesHandWorkedValues) {
  const Matrix3 c = measurementCovariance({0, 0, 2}, OccupancyParams());
  EXPECT_NEAR(c(0, 0), 4e-6, 1e-12);
  EXPECT_NEAR(c(1, 1), 4e-6, 1e-12);
  EXPECT_NEAR(c(2, 2), 1.0 / 900.0, 1e-9);
  EXPECT_EQ(measurementCovariance(Vector3::Zero(), OccupancyParams()), Matrix3(Matrix3::Zero()));
}

TEST(MotionFactor, FeatureReadingForgivesErrorsAlongTheRay) {
  const Pose still = Pose::Identity();
  const OccupancyParams params;
  const double exact = featureMotionFactor({0, 0, 2}, {0, 0, 2}, still, Matrix6::Zero(), params);
  const double along = featureMotionFactor({0, 0, 2.03}, {0, 0, 2}, still, Matrix6::Zero(), params);
  const double across =
      featureMotionFactor({0.03, 0, 2}, {0, 0, 2}, still, Matrix6::Zero(), params);
  EXPECT_DOUBLE_EQ(exact, 1.0);
  EXPECT_GT(along, 0.7);
  EXPECT_LT(across, 1e-6);
}

TEST(MotionFactor, UncertainTurnCountsWithTheLeverArm) {
  Matrix6 turn = Matrix6::Zero();
  turn(4, 4) = 1e-4;  // 0.01 rad about y
  // At 2 m that is 20 mm sideways, so 20 mm off is about one deviation.
  const double near_factor =
      featureMotionFactor({0.02, 0, 2}, {0, 0, 2}, Pose::Identity(), turn, OccupancyParams());
  EXPECT_NEAR(near_factor, std::exp(-0.5 * 4e-4 / (4e-4 + 8e-6)), 0.01);
}

TEST(MotionFactor, FeatureReadingFollowsTheMotion) {
  Pose motion = Pose::Identity();
  motion.linear() = Eigen::AngleAxisd(0.3, Vector3::UnitY()).toRotationMatrix();
  motion.translation() = Vector3(0.1, 0.0, -0.4);
  const Vector3 before(0.5, 0.2, 3.0);
  EXPECT_NEAR(
      featureMotionFactor(motion * before, before, motion, Matrix6::Zero(), OccupancyParams()), 1.0,
      1e-9);
}

}  // namespace
}  // namespace planar_mapping
