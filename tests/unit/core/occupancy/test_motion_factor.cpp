// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/occupancy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

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
