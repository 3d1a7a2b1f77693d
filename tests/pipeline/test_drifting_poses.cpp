// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Scans, which have no features: what their clouds say of given poses, and of none.
#include <gtest/gtest.h>

#include "planar_mapping/pipeline/pipeline.h"
#include "ring_scan.h"

namespace planar_mapping {
namespace {

Pipeline pipelineWith(const std::string& poses) {
  StageTable table;
  registerBuiltinStages(table);
  return Pipeline(parseConfiguration(
      "version: 1\nstages:\n  - stage: motion_estimation\n    poses: " + poses +
          "\n  - stage: multi_plane_segmentation\n    distance_threshold_m: auto\n"
          "  - stage: planar_cuboid_approximation\n    up: [0, 0, 1]\n",
      "test", table));
}

Pose poseAt(double x, double yaw) {
  Pose pose = Pose::Identity();
  pose.translation() = Vector3(x, 0.1 * x, 0.0);
  pose.linear() = Eigen::AngleAxisd(yaw, Vector3::UnitZ()).toRotationMatrix();
  return pose;
}

/// A scan from inside a hall. \param size  of it, along x
Frame scanFrom(std::size_t number, const Pose& T_world_scanner, double size, Random& random) {
  const Eigen::Array3d at = T_world_scanner.translation().array();
  const double heading = -std::atan2(T_world_scanner(1, 0), T_world_scanner(0, 0));
  Frame frame;
  frame.number = number;
  frame.source = "scan " + std::to_string(number);
  frame.timestamp = static_cast<double>(number);
  frame.cloud = cloudOf(test::ringScan(Eigen::Array3d(-3.0, -4.0, -1.2) - at,
                                       Eigen::Array3d(size, 5.0, 2.0) - at, heading, 0.01, random),
                        1800, 16);
  return frame;
}

TEST(DriftingPoses, OfScansAreCorrectedByTheirClouds) {
  constexpr std::size_t kScans = 16;
  Pipeline pipeline = pipelineWith("prior");
  Random random(1);
  Pose given = Pose::Identity(), truth = given, found = given;
  for (std::size_t i = 0; i < kScans; ++i) {
    const Pose before = truth;
    truth = poseAt(0.3 * static_cast<double>(i), 0.03 * static_cast<double>(i));
    given = given * before.inverse() * truth * poseAt(i == 0 ? 0.0 : 0.015, i == 0 ? 0.0 : 0.004);
    Frame frame = scanFrom(i, truth, 8.0, random);
    frame.given_pose = given;
    ASSERT_EQ("", pipeline.process(frame).skip_reason) << i;
    found = frame.T_world_sensor;
  }
  EXPECT_GT((given.translation() - truth.translation()).norm(), 0.2);
  EXPECT_LT((found.translation() - truth.translation()).norm(), 0.1);
  EXPECT_GT(Eigen::AngleAxisd((given.inverse() * truth).linear()).angle(), 0.05);
  EXPECT_LT(Eigen::AngleAxisd((found.inverse() * truth).linear()).angle(), 0.02);
}

TEST(DriftingPoses, OfExactOnesNothingIsLost) {
  Pipeline pipeline = pipelineWith("prior");
  Random random(2);
  for (std::size_t i = 0; i < 8; ++i) {
    Frame frame = scanFrom(i, poseAt(0.3 * static_cast<double>(i), 0.0), 8.0, random);
    frame.given_pose = poseAt(0.3 * static_cast<double>(i), 0.0);
    ASSERT_EQ("", pipeline.process(frame).skip_reason) << i;
    EXPECT_LT((frame.T_world_sensor.translation() - frame.given_pose->translation()).norm(), 0.02);
  }
}

TEST(DriftingPoses, AScanWithoutOneDoesNotMoveTheNext) {
  Pipeline pipeline = pipelineWith("prior");
  Random random(4);
  for (std::size_t i = 0; i < 8; ++i) {
    const Pose truth = poseAt(0.3 * static_cast<double>(i), 0.0);
    Frame frame = scanFrom(i, truth, 8.0, random);
    if (i != 4) frame.given_pose = truth;
    ASSERT_EQ("", pipeline.process(frame).skip_reason) << i;
    EXPECT_LT((frame.T_world_sensor.translation() - truth.translation()).norm(), 0.03) << i;
  }
}

/// This hall looks the same from its other end; after many scans that were left out no place is
/// looked for at all.
TEST(DriftingPoses, AfterManyLostScansACloudAloneIsNotPlaced) {
  for (const std::size_t lost : {1, 8}) {
    Pipeline pipeline = pipelineWith("ignore");
    Random random(3);
    std::size_t number = 0;
    for (; number < 3; ++number) {
      Frame frame = scanFrom(number, poseAt(0.2 * static_cast<double>(number), 0.0), 8.0, random);
      ASSERT_EQ("", pipeline.process(frame).skip_reason) << number;
    }
    for (std::size_t i = 0; i < lost; ++i, ++number) {
      Frame elsewhere = scanFrom(number, poseAt(20.0, 0.0), 40.0, random);
      ASSERT_NE("", pipeline.process(elsewhere).skip_reason) << number;
    }
    Frame again = scanFrom(number, poseAt(0.4, 0.0), 8.0, random);
    const std::string reason = pipeline.process(again).skip_reason;
    EXPECT_NE("", reason);
    EXPECT_EQ(lost > 5, reason.find("too many frames") != std::string::npos) << reason;
  }
}

}  // namespace
}  // namespace planar_mapping
