// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/localization/odometry/motion_refinement.h"
#include "planar_mapping/localization/pose_evidence.h"
#include "planar_mapping/localization/view_alignment.h"
#include "planar_mapping/localization/view_tracking.h"
#include "tests/unit/localization/textured_wall.h"

namespace planar_mapping::detail {
namespace {

using textured_wall::kHeight;
using textured_wall::kWidth;
using textured_wall::placed;

PinholeCamera pinhole() {
  const FeatureCamera camera = textured_wall::camera();
  return {camera.fx, camera.fy, camera.cx, camera.cy, kWidth, kHeight};
}

View viewAt(const Pose& T_world_camera, std::uint64_t seed = 1) {
  const textured_wall::View seen = textured_wall::viewFrom(T_world_camera, seed);
  LocalizerFrame frame;
  frame.gray = seen.gray;
  frame.cloud = seen.cloud();
  frame.camera = pinhole();
  View view = makeView(frame, SensorNoise());
  addFeatures(view);
  return view;
}

double metresOff(const Pose& a, const Pose& b) {
  return motionDifference(a, b).head<3>().norm();
}

TEST(ReprojectionResidual, ItsJacobianIsThatOfDifferences) {
  const FeatureCamera camera = textured_wall::camera();
  const Pose motion = placed({0.1, -0.2, 0.3}, {0.2, -0.1, 0.3});
  const Vector3 before(0.4, -0.3, 2.5);
  const Vector3 point = motion * before;
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << projectionJacobian(camera, point),
      projectionJacobian(camera, point) * crossMatrix(-point);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    Vector6 step = Vector6::Zero();
    step[i] = kStep;
    const FeatureSighting more = project(camera, motionStep(step) * point);
    const FeatureSighting less = project(camera, motionStep(-step) * point);
    const Vector3 differences((more.column - less.column) / (2 * kStep),
                              (more.row - less.row) / (2 * kStep),
                              (more.inverse_depth - less.inverse_depth) / (2 * kStep));
    EXPECT_LT((jacobian.col(i) - differences).norm(), 1e-4 * (1.0 + differences.norm())) << i;
  }
}

TEST(ReprojectionResidual, SimulatedMatchesHaveThreeSquaredSigmasInTheMean) {
  const SensorNoise noise;
  const FeatureCamera camera = textured_wall::camera();
  View view;
  view.camera = camera;
  const PlacedView map{&view, placed({0.2, 0.1, -0.3}, {0.1, 0.3, -0.2})};
  const Pose T_now_map = placed({0.1, -0.2, 0.2}, {0.05, -0.2, 0.1});
  const Pose T_now_view = T_now_map * map.T_map_view;
  Random random(7);
  double sum = 0.0;
  int count = 0;
  for (int i = 0; i < 20000; ++i) {
    ViewFeature feature;
    const FeatureSighting seen{random.uniform(0.0, kWidth), random.uniform(0.0, kHeight),
                               1.0 / random.uniform(1.0, 5.0)};
    const Vector3 point = T_now_view * backProject(camera, seen);
    if (point.z() < 0.5) continue;
    const FeatureSighting there = project(camera, point);
    const double size = random.uniform(2.0, 12.0);
    const double pixel = std::hypot(noise.pixel, noise.pixel_per_size * size);
    const auto disturbed = [&](const FeatureSighting& true_one, Vector3& variance) {
      const double rho = noise.depthSigma(true_one.inverse_depth);
      variance = {pixel * pixel, pixel * pixel, rho * rho};
      return FeatureSighting{true_one.column + pixel * random.normal(),
                             true_one.row + pixel * random.normal(),
                             true_one.inverse_depth + rho * random.normal()};
    };
    feature.seen = disturbed(seen, feature.variance);
    FeatureMatch match = mapSide(map, feature);
    match.now = disturbed(there, match.now_variance);
    sum += squaredError(match, camera, T_now_map);
    ++count;
  }
  ASSERT_GT(count, 10000);
  EXPECT_NEAR(sum / count, 3.0, 0.1);
}

TEST(ViewMatching, MostMutualMatchesAreOfTheSamePlace) {
  const Pose T_world_b = placed({0.2, 0.05, 0.1}, {0.03, -0.08, 0.05});
  const View a = viewAt(Pose::Identity());
  const View b = viewAt(T_world_b);
  const std::vector<FeaturePair> pairs = matchFeatures({{&a, Pose::Identity()}}, b);
  ASSERT_GT(pairs.size(), 50u);
  std::size_t right = 0;
  for (const FeaturePair& pair : pairs) {
    const FeatureSighting there = project(
        b.camera, T_world_b.inverse() * backProject(a.camera, a.features[pair.before].seen));
    const FeatureSighting& seen = b.features[pair.now].seen;
    if (std::hypot(there.column - seen.column, there.row - seen.row) < 3.0) ++right;
  }
  EXPECT_GT(10 * right, 8 * pairs.size());
}

TEST(ViewAlignment, FindsTheMotionWithoutFeatures) {
  const Pose T_world_b = placed({0.06, 0.03, 0.05}, {0.02, -0.03, 0.02});
  const View a = viewAt(Pose::Identity());
  const View b = viewAt(T_world_b);
  const LocalMap map = {{&a, Pose::Identity()}};
  const Pose coarse = alignViews(map, b, Pose::Identity(), AlignLevel::Search).T_now_map;
  const Pose fine = alignViews(map, b, coarse, AlignLevel::Refine).T_now_map;
  EXPECT_LT(metresOff(T_world_b.inverse(), fine), 0.01);
}

TEST(ViewTracking, FollowsFeaturesFromAPoseThatIsNearlyRight) {
  const Pose T_world_b = placed({0.05, 0.02, 0.03}, {0.01, -0.03, 0.02});
  View a = viewAt(Pose::Identity());
  addCorners(a);
  const View b = viewAt(T_world_b);
  const Pose guess = placed({0.01, 0.0, 0.01}, {0.0, 0.004, 0.0}) * T_world_b.inverse();
  const TrackedFeatures tracked = trackFeatures({{&a, Pose::Identity()}}, b, guess);
  ASSERT_GT(tracked.expected[0], 50u);
  std::size_t right = 0;
  for (const FeatureMatch& match : tracked.matches) {
    if (squaredError(match, b.camera, T_world_b.inverse()) < 11.34) ++right;
  }
  EXPECT_GT(2 * right, tracked.expected[0]);
}

TEST(PoseEvidence, TheRightPoseAgreesAndAWrongOneDoesNot) {
  const Pose T_world_b = placed({0.2, 0.05, 0.1}, {0.03, -0.08, 0.05});
  const View a = viewAt(Pose::Identity());
  const View b = viewAt(T_world_b);
  const LocalMap map = {{&a, Pose::Identity()}};
  PoseEvidence right, wrong;
  weighCells(map, b, T_world_b.inverse(), right);
  weighCells(map, b, placed({0.4, 0.0, 0.4}, {0.0, 0.0, 0.0}) * T_world_b.inverse(), wrong);
  EXPECT_GT(right.agreement, 0.95);
  EXPECT_LT(right.seen_through, 0.02);
  EXPECT_GT(right.correlation, 0.6);
  EXPECT_LT(wrong.agreement, 0.5);
  EXPECT_LT(wrong.correlation, 0.3);
  EXPECT_GT(logOdds(right, false), logOdds(wrong, false) + 3.0);
}

TEST(PoseEvidence, EveryKindOfEvidenceCounts) {
  PoseEvidence evidence;
  evidence.inliers = 60;
  evidence.expected = 100;
  evidence.off_plane = 30;
  evidence.agreement = 0.95;
  evidence.seen_through = 0.02;
  evidence.overlap = 0.8;
  evidence.correlation = 0.6;
  const double before = logOdds(evidence, true);
  EXPECT_GT(before, 3.0);
  const auto less = [&](auto change) {
    PoseEvidence other = evidence;
    change(other);
    return logOdds(other, true) < before - 0.3;
  };
  EXPECT_TRUE(less([](PoseEvidence& e) { e.inliers = 30; }));
  EXPECT_TRUE(less([](PoseEvidence& e) { e.off_plane = 3; }));
  EXPECT_TRUE(less([](PoseEvidence& e) { e.seen_through = 0.1; }));
  EXPECT_TRUE(less([](PoseEvidence& e) { e.correlation = 0.2; }));
  // Surfaces of any room agree in a few places.
  evidence.overlap = 0.1;
  EXPECT_LT(logOdds(evidence, false), -10.0);
}

TEST(OffPlane, CountsWhatIsBesideTheLargestPlane) {
  std::vector<FeatureMatch> matches;
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    FeatureMatch match;
    match.before = {random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), i < 80 ? 2.0 : 2.5};
    match.covariance = 1e-4 * Matrix3::Identity();
    matches.push_back(match);
  }
  EXPECT_EQ(offPlane(matches, std::vector<std::uint8_t>(100, 1), random), 20u);
  EXPECT_EQ(offPlane(matches, std::vector<std::uint8_t>(100, 0), random), 0u);
}

}  // namespace
}  // namespace planar_mapping::detail
