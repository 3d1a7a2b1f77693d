// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/odometry/motion_estimation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "feature_corridor.h"
#include "numbers.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

FeatureCamera stereoCamera() {
  return test::stereoCamera(500.0, 500.0, 320.0, 240.0, 0.12, 0.5);
}

Pose smallMotion() {
  Vector6 step;
  step << 0.12, -0.03, 0.2, 0.02, -0.05, 0.01;
  return motionStep(step);
}

/// Points in view of the camera before, seen before and now with the noise of the model.
std::vector<FeatureMatch> noisyMatches(const FeatureCamera& camera, const Pose& motion,
                                       std::size_t count, double noise, Random& random) {
  std::vector<FeatureMatch> matches;
  while (matches.size() < count) {
    const double z = random.uniform(1.5, 8.0);
    const Vector3 point(random.uniform(-0.5, 0.5) * z, random.uniform(-0.4, 0.4) * z, z);
    const auto measured = [&](const Vector3& p) {
      FeatureSighting s = project(camera, p);
      const Vector3 deviation = sightingVariance(camera, s.inverse_depth).cwiseSqrt();
      s.column += noise * deviation.x() * random.normal();
      s.row += noise * deviation.y() * random.normal();
      s.inverse_depth += noise * deviation.z() * random.normal();
      return s;
    };
    const FeatureSighting before = measured(point);
    FeatureMatch match;
    match.now = measured(motion * point);
    if (before.inverse_depth < 0.02 || match.now.inverse_depth < 0.02) continue;
    match.before = backProject(camera, before);
    match.covariance = positionCovariance(camera, before);
    matches.push_back(match);
  }
  return matches;
}

void spoil(std::vector<FeatureMatch>& matches, std::size_t count, Random& random) {
  for (std::size_t i = 0; i < count; ++i) {
    matches[i].now = {random.uniform(0.0, 640.0), random.uniform(0.0, 480.0),
                      random.uniform(0.1, 0.7)};
  }
}

double translationError(const Pose& a, const Pose& b) {
  return motionDifference(a, b).head<3>().norm();
}
double rotationError(const Pose& a, const Pose& b) {
  return motionDifference(a, b).tail<3>().norm();
}

TEST(FeatureCamera, ProjectionAndBackProjectionAreInverse) {
  const FeatureCamera camera = stereoCamera();
  const Vector3 point(0.3, -0.2, 2.0);
  const FeatureSighting seen = project(camera, point);
  EXPECT_DOUBLE_EQ(seen.column, 320.0 + 500.0 * 0.15);
  EXPECT_DOUBLE_EQ(seen.row, 240.0 - 500.0 * 0.1);
  EXPECT_DOUBLE_EQ(seen.inverse_depth, 0.5);
  EXPECT_TRUE(backProject(camera, seen).isApprox(point, 1e-12));
}

TEST(FeatureCamera, DepthErrorIsThatOfThePaper) {
  // dz = z^2 / (B f) * dd = 4 / 60 * 0.5
  EXPECT_NEAR(stereoCamera().depthError(2.0), 4.0 / 60.0 * 0.5, 1e-12);
  const Matrix3 covariance = positionCovariance(stereoCamera(), {320.0, 240.0, 0.5});
  EXPECT_NEAR(std::sqrt(covariance(2, 2)), 4.0 / 60.0 * 0.5, 1e-12);
  EXPECT_NEAR(std::sqrt(covariance(0, 0)), 0.5 * 2.0 / 500.0, 1e-12);
  EXPECT_NEAR(covariance(0, 2), 0.0, 1e-15);
}

TEST(FeatureCamera, TakesThePixelFromTheFeatureOrFromItsPosition) {
  const FeatureCamera camera = stereoCamera();
  KeyFeature feature;
  feature.position = Vector3(0.0, 0.0, 4.0);
  FeatureSighting seen;
  ASSERT_TRUE(sightingOf(camera, feature, seen));
  EXPECT_DOUBLE_EQ(seen.column, 320.0);
  feature.column = 321.0F;
  feature.row = 239.0F;
  ASSERT_TRUE(sightingOf(camera, feature, seen));
  EXPECT_DOUBLE_EQ(seen.column, 321.0);
  EXPECT_DOUBLE_EQ(seen.row, 239.0);
}

TEST(FeatureCamera, RefusesPositionsItCannotSee) {
  const FeatureCamera camera = stereoCamera();
  FeatureSighting seen;
  for (const Vector3& position :
       {Vector3(0, 0, 0), Vector3(0, 0, -1), Vector3(test::kNan, 0, 1), Vector3(0, 0, 1e10),
        Vector3(0, 0, std::numeric_limits<double>::infinity())}) {
    KeyFeature feature;
    feature.position = position;
    EXPECT_FALSE(sightingOf(camera, feature, seen)) << position.transpose();
  }
}

TEST(FeatureCamera, RefusesBadParameters) {
  FeatureCamera camera = stereoCamera();
  camera.fx = 0.0;
  EXPECT_THROW(camera.validate(), ParameterError);
  camera = stereoCamera();
  camera.pixel_error = test::kNan;
  EXPECT_THROW(camera.validate(), ParameterError);
  camera = stereoCamera();
  camera.depth_error = 0.0;
  camera.depth_error_growth = 0.0;
  EXPECT_THROW(camera.validate(), ParameterError);
}

TEST(RigidMotion, FindsTheMotionOfExactPoints) {
  const std::vector<Vector3> p = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  const Pose motion = smallMotion();
  std::vector<Vector3> q;
  for (const Vector3& point : p) q.push_back(motion * point);
  Pose found;
  ASSERT_TRUE(rigidMotion(p, q, found));
  EXPECT_TRUE(found.isApprox(motion, 1e-12));
  // Three points in a plane do not let it mirror.
  ASSERT_TRUE(rigidMotion({p[0], p[1], p[2]}, {q[0], q[1], q[2]}, found));
  EXPECT_TRUE(found.isApprox(motion, 1e-12));
  EXPECT_NEAR(found.linear().determinant(), 1.0, 1e-12);
}

TEST(RigidMotion, RefusesWhatDoesNotFixIt) {
  Pose found = smallMotion();
  const Pose untouched = found;
  const std::vector<Vector3> line = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}};
  EXPECT_FALSE(rigidMotion(line, line, found));
  const std::vector<Vector3> same(4, Vector3(1, 2, 3));
  EXPECT_FALSE(rigidMotion(same, same, found));
  EXPECT_FALSE(rigidMotion({{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {1, 0, 0}}, found));
  EXPECT_FALSE(rigidMotion({{0, 0, 0}, {1, 0, 0}, {0, test::kNan, 0}},
                           {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, found));
  EXPECT_FALSE(rigidMotion(line, same, found));
  EXPECT_TRUE(found.isApprox(untouched));
}

TEST(MotionStep, IsUndoneByTheDifference) {
  Vector6 step;
  step << 1.0, -2.0, 0.5, 0.3, -0.2, 0.9;
  const Pose from = smallMotion();
  EXPECT_TRUE(motionDifference(from, motionStep(step) * from).isApprox(step, 1e-10));
  EXPECT_TRUE(motionStep(Vector6::Zero()).isApprox(Pose::Identity()));
}

TEST(EstimateMotion, FindsTheExactMotionOfExactMatches) {
  Random random;
  const FeatureCamera camera = stereoCamera();
  const std::vector<FeatureMatch> matches = noisyMatches(camera, smallMotion(), 60, 0.0, random);
  const MotionEstimate found = estimateMotion(matches, camera, MotionParams(), random);
  ASSERT_TRUE(found.found());
  EXPECT_EQ(found.inliers, 60u);
  EXPECT_LT(translationError(found.T_now_before, smallMotion()), 1e-8);
  EXPECT_LT(rotationError(found.T_now_before, smallMotion()), 1e-8);
}

TEST(EstimateMotion, FindsTheMotionAmongSixtyPercentWrongMatches) {
  Random random(7);
  const FeatureCamera camera = stereoCamera();
  std::vector<FeatureMatch> matches = noisyMatches(camera, smallMotion(), 200, 1.0, random);
  spoil(matches, 120, random);
  const MotionEstimate found = estimateMotion(matches, camera, MotionParams(), random);
  ASSERT_TRUE(found.found());
  EXPECT_LT(translationError(found.T_now_before, smallMotion()), 0.01);
  EXPECT_LT(rotationError(found.T_now_before, smallMotion()), 0.004);
  const auto wrong = std::count(found.is_inlier.begin(), found.is_inlier.begin() + 120, 1);
  EXPECT_LE(wrong, 3);
  EXPECT_GE(found.inliers, 74u);  // of 80, with a bound that 1 % of normal errors exceed
}

TEST(EstimateMotion, CovarianceTellsTheErrorsThatOccur) {
  // Over many trials the squared Mahalanobis error of six parameters has mean 6.
  const FeatureCamera camera = stereoCamera();
  double sum = 0.0;
  constexpr int kTrials = 60;
  for (int trial = 0; trial < kTrials; ++trial) {
    Random random(static_cast<std::uint64_t>(100 + trial));
    const auto matches = noisyMatches(camera, smallMotion(), 100, 1.0, random);
    const MotionEstimate found = estimateMotion(matches, camera, MotionParams(), random);
    ASSERT_TRUE(found.found());
    const Vector6 error = motionDifference(smallMotion(), found.T_now_before);
    sum += error.dot(found.covariance.inverse() * error);
  }
  EXPECT_GT(sum / kTrials, 4.0);
  EXPECT_LT(sum / kTrials, 8.5);
}

TEST(EstimateMotion, FarPointsCountWithTheirUncertainty) {
  // Far points alone fix the rotation well, however bad their depth.
  Random random(3);
  const FeatureCamera camera = stereoCamera();
  std::vector<FeatureMatch> matches;
  const Pose motion = smallMotion();
  for (int i = 0; i < 150; ++i) {
    const double z = i < 30 ? random.uniform(1.5, 3.0) : random.uniform(20.0, 40.0);
    const Vector3 point(random.uniform(-0.5, 0.5) * z, random.uniform(-0.4, 0.4) * z, z);
    FeatureSighting before = project(camera, point);
    FeatureSighting now = project(camera, motion * point);
    const double w_error = std::sqrt(sightingVariance(camera, before.inverse_depth).z());
    before.inverse_depth = std::max(5e-3, before.inverse_depth + w_error * random.normal());
    now.inverse_depth = std::max(5e-3, now.inverse_depth + w_error * random.normal());
    matches.push_back({backProject(camera, before), positionCovariance(camera, before), now});
  }
  const MotionEstimate found = estimateMotion(matches, camera, MotionParams(), random);
  ASSERT_TRUE(found.found());
  EXPECT_GT(found.inliers, 140u);
  EXPECT_LT(rotationError(found.T_now_before, motion), 1e-3);
  EXPECT_LT(translationError(found.T_now_before, motion), 0.01);
}

TEST(EstimateMotion, DepthCameraWithoutDisparityWorksToo) {
  Random random(5);
  FeatureCamera camera = stereoCamera();
  camera.depth_error = 0.002;
  camera.depth_error_growth = 0.0015;
  const auto matches = noisyMatches(camera, smallMotion(), 100, 1.0, random);
  const MotionEstimate found = estimateMotion(matches, camera, MotionParams(), random);
  ASSERT_TRUE(found.found());
  EXPECT_LT(translationError(found.T_now_before, smallMotion()), 0.005);
}

TEST(EstimateMotion, IsDeterministic) {
  const FeatureCamera camera = stereoCamera();
  Random source(11);
  std::vector<FeatureMatch> matches = noisyMatches(camera, smallMotion(), 80, 1.0, source);
  spoil(matches, 30, source);
  Random one(1);
  Random two(1);
  const MotionEstimate a = estimateMotion(matches, camera, MotionParams(), one);
  const MotionEstimate b = estimateMotion(matches, camera, MotionParams(), two);
  EXPECT_EQ(a.T_now_before.matrix(), b.T_now_before.matrix());
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.is_inlier, b.is_inlier);
}

TEST(EstimateMotion, OrderOfMatchesDoesNotMatter) {
  const FeatureCamera camera = stereoCamera();
  Random source(12);
  std::vector<FeatureMatch> matches = noisyMatches(camera, smallMotion(), 80, 1.0, source);
  spoil(matches, 20, source);
  Random one(1);
  const MotionEstimate a = estimateMotion(matches, camera, MotionParams(), one);
  std::reverse(matches.begin(), matches.end());
  Random two(2);
  const MotionEstimate b = estimateMotion(matches, camera, MotionParams(), two);
  ASSERT_TRUE(a.found() && b.found());
  EXPECT_LT(translationError(a.T_now_before, b.T_now_before), 1e-3);
  EXPECT_NEAR(static_cast<double>(a.inliers), static_cast<double>(b.inliers), 2.0);
}

TEST(EstimateMotion, AWrongGuessDoesNotDeceive) {
  const FeatureCamera camera = stereoCamera();
  Random random(13);
  std::vector<FeatureMatch> matches = noisyMatches(camera, smallMotion(), 100, 1.0, random);
  const Pose wrong = motionStep(10.0 * motionDifference(Pose::Identity(), smallMotion()));
  const MotionEstimate found = estimateMotion(matches, camera, MotionParams(), random, &wrong);
  ASSERT_TRUE(found.found());
  EXPECT_LT(translationError(found.T_now_before, smallMotion()), 0.01);
}

TEST(EstimateMotion, SaysWhyThereIsNone) {
  const FeatureCamera camera = stereoCamera();
  Random random(17);
  EXPECT_EQ(estimateMotion({}, camera, MotionParams(), random).status, MotionStatus::TooFewMatches);
  std::vector<FeatureMatch> matches = noisyMatches(camera, smallMotion(), 60, 1.0, random);
  EXPECT_EQ(
      estimateMotion({matches.begin(), matches.begin() + 7}, camera, MotionParams(), random).status,
      MotionStatus::TooFewMatches);
  spoil(matches, 60, random);
  const MotionEstimate none = estimateMotion(matches, camera, MotionParams(), random);
  EXPECT_EQ(none.status, MotionStatus::TooFewInliers);
  EXPECT_TRUE(none.T_now_before.isApprox(Pose::Identity()));
}

TEST(EstimateMotion, PointsOnALineDoNotFixTheMotion) {
  const FeatureCamera camera = stereoCamera();
  Random random(19);
  std::vector<FeatureMatch> matches;
  for (int i = 0; i < 40; ++i) {
    const Vector3 point(0.02 * i - 0.4, 0.0, 2.0);
    const FeatureSighting before = project(camera, point);
    matches.push_back(
        {point, positionCovariance(camera, before), project(camera, smallMotion() * point)});
  }
  EXPECT_FALSE(estimateMotion(matches, camera, MotionParams(), random).found());
  const std::vector<FeatureMatch> same(40, matches.front());
  EXPECT_FALSE(estimateMotion(same, camera, MotionParams(), random).found());
}

TEST(EstimateMotion, UnusableMatchesNeverAgree) {
  const FeatureCamera camera = stereoCamera();
  Random random(23);
  std::vector<FeatureMatch> matches = noisyMatches(camera, smallMotion(), 60, 0.5, random);
  matches[0].before.x() = test::kNan;
  matches[1].now.inverse_depth = -1.0;
  matches[2].now.column = std::numeric_limits<double>::infinity();
  matches[3].covariance(0, 0) = test::kNan;
  matches[4].before = Vector3(0, 0, -5);
  matches[5].before = Vector3(1e9, 1e9, 1e9);
  const MotionEstimate found = estimateMotion(matches, camera, MotionParams(), random);
  ASSERT_TRUE(found.found());
  for (int i = 0; i < 6; ++i) EXPECT_EQ(found.is_inlier[static_cast<std::size_t>(i)], 0) << i;
  EXPECT_LT(translationError(found.T_now_before, smallMotion()), 0.01);
}

TEST(EstimateMotion, RefusesBadParameters) {
  const FeatureCamera camera = stereoCamera();
  Random random;
  const auto refused = [&](auto change) {
    MotionParams params;
    change(params);
    EXPECT_THROW(estimateMotion({}, camera, params, random), ParameterError);
  };
  refused([](MotionParams& p) { p.inlier_sigmas = 0.0; });
  refused([](MotionParams& p) { p.min_matches = 2; });
  refused([](MotionParams& p) { p.min_inliers = 2; });
  refused([](MotionParams& p) { p.max_iterations = 0; });
  refused([](MotionParams& p) { p.max_translation_error = 0.0; });
}

}  // namespace
}  // namespace planar_mapping
