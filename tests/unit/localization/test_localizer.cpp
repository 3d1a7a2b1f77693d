// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/localizer.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "tests/unit/localization/textured_wall.h"

namespace planar_mapping {
namespace {

using textured_wall::kHeight;
using textured_wall::kWidth;
using textured_wall::placed;

/// Frames of a wall, with what they are made of.
struct Shot {
  textured_wall::View seen;
  LocalizerFrame frame;

  explicit Shot(const Pose& T_world_camera, std::uint64_t seed = 1)
      : seen(textured_wall::viewFrom(T_world_camera, seed)) {
    const FeatureCamera camera = textured_wall::camera();
    frame.camera = {camera.fx, camera.fy, camera.cx, camera.cy, kWidth, kHeight};
    frame.cloud = seen.cloud();
    frame.gray = seen.gray;
  }
};

Pose stepAt(int i) {
  return placed({0.04 * i, 0.01 * i, 0.02 * i}, {0.0, -0.02 * i, 0.005 * i});
}

TEST(Localizer, FollowsACameraInOneSubmap) {
  Localizer localizer;
  for (int i = 0; i < 8; ++i) {
    const Shot shot(stepAt(i));
    const Localization found = localizer.locate(shot.frame);
    EXPECT_EQ(found.submap, 0u) << i;
    EXPECT_EQ(found.begins_submap, i == 0);
    const Pose off = stepAt(i).inverse() * found.T_submap_camera;
    EXPECT_LT(off.translation().norm(), 0.01) << i;
    EXPECT_LT(rotationAngle(off.linear()), 0.5 * kRadiansPerDegree) << i;
    if (i == 0) continue;
    EXPECT_GT(found.evidence.log_odds, 0.8);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(found.covariance);
    EXPECT_GT(solver.eigenvalues().minCoeff(), 0.0);
    const Vector6 error = motionDifference(stepAt(i), found.T_submap_camera);
    EXPECT_LT(error.dot(found.covariance.inverse() * error), 22.46) << i;
  }
  EXPECT_EQ(localizer.submaps(), 1u);
}

TEST(Localizer, ALostTrackBeginsASubmapAndTheOldOneIsFoundAgain) {
  Localizer localizer;
  for (int i = 0; i < 3; ++i) localizer.locate(Shot(stepAt(i)).frame);
  const Localization elsewhere = localizer.locate(Shot(stepAt(3), 77).frame);
  EXPECT_TRUE(elsewhere.begins_submap);
  EXPECT_TRUE(elsewhere.is_keyframe);
  EXPECT_EQ(elsewhere.submap, 1u);
  EXPECT_TRUE(elsewhere.T_submap_camera.isApprox(Pose::Identity()));
  const Localization back = localizer.locate(Shot(stepAt(4)).frame);
  EXPECT_EQ(back.submap, 0u);
  EXPECT_LT((stepAt(4).inverse() * back.T_submap_camera).translation().norm(), 0.01);
}

TEST(Localizer, TheSameFrameTwiceDoesNotMove) {
  Localizer localizer;
  const Shot shot(Pose::Identity());
  localizer.locate(shot.frame);
  const Localization again = localizer.locate(shot.frame);
  EXPECT_EQ(again.submap, 0u);
  EXPECT_FALSE(again.is_keyframe);
  EXPECT_LT(again.T_submap_camera.translation().norm(), 1e-3);
}

TEST(Localizer, FramesOutOfOrderArePlacedAllTheSame) {
  Localizer localizer;
  for (const int i : {0, 2, 1, 4, 3}) {
    const Localization found = localizer.locate(Shot(stepAt(i)).frame);
    EXPECT_EQ(found.submap, 0u) << i;
    EXPECT_LT((stepAt(i).inverse() * found.T_submap_camera).translation().norm(), 0.015) << i;
  }
}

TEST(Localizer, DarkFramesAndThoseWithoutDepthBeginSubmapsAndHarmNothing) {
  Localizer localizer;
  localizer.locate(Shot(stepAt(0)).frame);
  Shot dark(stepAt(1));
  std::fill(dark.frame.gray.pixels.begin(), dark.frame.gray.pixels.end(), std::uint8_t{0});
  std::fill(dark.seen.xyz.begin(), dark.seen.xyz.end(), 0.0F);
  EXPECT_TRUE(localizer.locate(dark.frame).begins_submap);
  Shot blind(stepAt(1));
  std::fill(blind.seen.xyz.begin(), blind.seen.xyz.end(), std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(localizer.locate(blind.frame).begins_submap);
}

TEST(Localizer, ADarkFrameDoesNotEndATrack) {
  Localizer localizer;
  localizer.locate(Shot(stepAt(0)).frame);
  Shot dark(stepAt(1));
  std::fill(dark.frame.gray.pixels.begin(), dark.frame.gray.pixels.end(), std::uint8_t{0});
  std::fill(dark.seen.xyz.begin(), dark.seen.xyz.end(), 0.0F);
  localizer.locate(dark.frame);
  EXPECT_EQ(localizer.locate(Shot(stepAt(2)).frame).submap, 0u);
}

TEST(Localizer, StepsBetweenGivenPosesAreExpected) {
  // Twice the speed with each frame, which constant velocity does not expect.
  Localizer localizer;
  const Pose T_other_world = placed({5.0, -3.0, 1.0}, {0.5, 1.0, -0.3});
  for (const int i : {0, 1, 6}) {
    Shot shot(stepAt(i));
    shot.frame.prior = T_other_world * stepAt(i);
    shot.frame.prior_covariance = 1e-4 * Matrix6::Identity();
    const Localization found = localizer.locate(shot.frame);
    EXPECT_EQ(found.submap, 0u) << i;
    EXPECT_LT((stepAt(i).inverse() * found.T_submap_camera).translation().norm(), 0.015) << i;
  }
}

TEST(Localizer, GivesTheSameBitsTwice) {
  std::vector<Matrix4> poses[2];
  for (auto& run : poses) {
    Localizer localizer;
    for (int i = 0; i < 4; ++i)
      run.push_back(localizer.locate(Shot(stepAt(i)).frame).T_submap_camera.matrix());
  }
  for (std::size_t i = 0; i < poses[0].size(); ++i) EXPECT_EQ(poses[0][i], poses[1][i]) << i;
}

TEST(Localizer, RefusesImagesThatDoNotFit) {
  Localizer localizer;
  Shot shot(Pose::Identity());
  shot.frame.cloud = PointsView(shot.seen.xyz.data(), 320, 480, 3);
  EXPECT_THROW(localizer.locate(shot.frame), InputError);
  shot.frame.cloud = shot.seen.cloud();
  shot.frame.gray.channels = 3;
  EXPECT_THROW(localizer.locate(shot.frame), InputError);
  LocalizerParams params;
  params.noise.pixel = 0.0;
  EXPECT_THROW(Localizer{params}, ParameterError);
}

}  // namespace
}  // namespace planar_mapping
