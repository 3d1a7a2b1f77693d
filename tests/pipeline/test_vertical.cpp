// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "pipeline_frames.h"
#include "ring_scan.h"
#include "stereo_images.h"

namespace planar_mapping {
namespace {

using test::frameOf;
using test::pipelineOf;

constexpr const char* kStages =
    "  - stage: multi_plane_segmentation\n"
    "  - stage: planar_cuboid_approximation\n    up: auto\n";

double degreesBetween(const Vector3& a, const Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / M_PI;
}

/// World = first camera, which looks down by 44 degrees: no axis of the world is upwards, and the
/// images have upwards next to the axis that leans more.
TEST(Vertical, OfTheWorldOfACameraThatLooksDownIsWhatThePlanesSay) {
  const test::View view =
      test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.3, 44.0 * M_PI / 180.0));
  const Vector3 up = view.pose.linear().transpose() * Vector3::UnitZ();
  Frame frame = frameOf(view);
  frame.given_pose = Pose::Identity();
  Pipeline pipeline = pipelineOf(kStages);
  pipeline.setMeanUp({Eigen::AngleAxisd(10.0 * M_PI / 180.0, Vector3::UnitX()) * up, true});
  pipeline.process(frame);
  EXPECT_LT(degreesBetween(pipeline.map().params().approximation.up, up), 0.5);
}

/// Poses whose images have z upwards, and planes that lean against it: by little, they are off.
TEST(Vertical, IsZWhereTheImagesSayItUnlessFloorAndWallLeanByMoreThanTenDegrees) {
  const test::View view = test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.3, 0.2));
  for (const double lean : {0.12, 0.3}) {
    Frame frame = frameOf(view);
    frame.given_pose = Eigen::AngleAxisd(lean, Vector3::UnitX()) * view.pose;
    Pipeline pipeline = pipelineOf(kStages);
    pipeline.setMeanUp({Vector3::UnitZ(), false});
    pipeline.process(frame);
    const double off = degreesBetween(pipeline.map().params().approximation.up, Vector3::UnitZ());
    EXPECT_NEAR(lean < 0.2 ? 0.0 : lean * 180.0 / M_PI, off, 0.5);
    EXPECT_EQ(lean < 0.2 ? 0u : 1u, frame.notes.size());
    EXPECT_TRUE(frame.warnings.empty());
  }
}

TEST(Vertical, OfAllStagesIsThatOfTheRunWhereItIsGiven) {
  const test::View view = test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.3, 0.2));
  Frame frame = frameOf(view);
  frame.given_pose = view.pose;
  StageTable table;
  registerBuiltinStages(table);
  ConfigurationOverrides overrides;
  overrides.assignments = {"up=-y"};
  const std::string text =
      "version: 1\nstages:\n  - stage: multi_plane_segmentation\n"
      "  - stage: planar_cuboid_approximation\n    up: [0, 0, 1]\n";
  Configuration configuration = parseConfiguration(text, "test", table, overrides);
  EXPECT_NE(std::string::npos, effectiveYaml(configuration).find("\nup: -y\n"));
  Pipeline pipeline(std::move(configuration));
  pipeline.process(frame);
  EXPECT_EQ(pipeline.map().params().approximation.up, Vector3(-Vector3::UnitY()));
}

/// A world that was made level, by a camera that looks down by more than 45 degrees: its images
/// have upwards next to another axis than z.
TEST(Vertical, OfAWorldThatBeginsWithTheFirstFrameIsZ) {
  const test::View view =
      test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.3}, 0.3, 55.0 * M_PI / 180.0));
  Frame frame = frameOf(view);
  frame.given_pose.reset();
  Pipeline pipeline =
      pipelineOf(std::string("  - stage: motion_estimation\n    poses: ignore\n") + kStages);
  pipeline.process(frame);
  EXPECT_EQ(frame.skip_reason, "");
  EXPECT_EQ(pipeline.map().params().approximation.up, Vector3::UnitZ());
  const Vector3 up =
      frame.T_world_sensor.linear() * view.pose.linear().transpose() * Vector3::UnitZ();
  EXPECT_LT(degreesBetween(up, Vector3::UnitZ()), 1.0);
}

// Walls whose panels repeat: a camera that was lost seems to be where more of the known is seen.

constexpr double kWall = 2.0;   // depth, metres
constexpr double kPanel = 2.5;  // metres
constexpr double kStep = 0.5;   // of the camera along the wall, metres
const PinholeCamera kCamera{250.0, 250.0, 159.5, 119.5, 320, 240};

/// The wall from \p x along it; the image is black in the dark, its depths are not.
Frame frameAt(std::size_t number, double x, bool is_dark, double period = kPanel) {
  Frame frame;
  frame.number = number;
  frame.source = "frame " + std::to_string(number);
  frame.timestamp = static_cast<double>(number);
  frame.camera = kCamera;
  frame.images.left = {kCamera.width, kCamera.height, 1, {}};
  io::Calibration calibration;
  calibration.camera = kCamera;
  calibration.depth_scale = 1000.0;
  frame.images.calibration = calibration;
  std::vector<float> xyz;
  for (int row = 0; row < kCamera.height; ++row) {
    for (int column = 0; column < kCamera.width; ++column) {
      const Vector3 point = kWall * kCamera.rayOf(column, row);
      for (int k = 0; k < 3; ++k) xyz.push_back(static_cast<float>(point[k]));
      frame.images.left.pixels.push_back(
          is_dark ? static_cast<std::uint8_t>(number)
                  : static_cast<std::uint8_t>(test::wallTone(x + point.x(), point.y(), period, 1)));
    }
  }
  frame.cloud = cloudOf(xyz, 320, 240);
  return frame;
}

Pipeline pipelineWithMotion() {
  return pipelineOf(
      "  - stage: motion_estimation\n    poses: ignore\n  - stage: multi_plane_segmentation\n"
      "  - stage: planar_cuboid_approximation\n");
}

TEST(RepeatingWall, ALostCameraIsNotTakenBackByAPanel) {
  Pipeline pipeline = pipelineWithMotion();
  std::size_t before = 0;  // frames placed before the dark
  Vector3 start = Vector3::Zero();
  const auto check = [&](const Frame& frame) {
    const double x = kStep * static_cast<double>(frame.number);
    EXPECT_NEAR((frame.T_world_sensor.translation() - start).norm(), x, 0.1 + 0.05 * x)
        << frame.source;
  };
  for (std::size_t i = 0; i < 12; ++i) {
    const bool is_dark = i == 5 || i == 6;
    Frame frame = frameAt(i, kStep * static_cast<double>(i), is_dark);
    if (pipeline.process(frame).skip_reason.empty()) {
      if (i == 0) start = frame.T_world_sensor.translation();
      check(frame);
      before += i < 5 ? 1u : 0u;
    }
  }
  EXPECT_LE(4u, before);
}

TEST(GivenPoses, AFrameWithoutOneIsPlacedInTheirWorld) {
  Pipeline pipeline = pipelineOf(
      "  - stage: motion_estimation\n  - stage: multi_plane_segmentation\n"
      "  - stage: planar_cuboid_approximation\n");
  for (std::size_t i = 0; i < 5; ++i) {
    const Pose truth(Eigen::Translation3d(7.0 + 0.1 * static_cast<double>(i), -2.0, 1.0));
    Frame frame = frameAt(i, 0.1 * static_cast<double>(i), false, 0.0);
    if (i != 3) frame.given_pose = truth;
    EXPECT_EQ("", pipeline.process(frame).skip_reason) << i;
    EXPECT_LT((frame.T_world_sensor.translation() - truth.translation()).norm(), 0.02) << i;
  }
}

// Scans, which have no features: what their clouds say of given poses, and of none.

Pipeline pipelineWith(const std::string& poses) {
  return pipelineOf("  - stage: motion_estimation\n    poses: " + poses +
                    "\n  - stage: multi_plane_segmentation\n    distance_threshold_m: auto\n"
                    "  - stage: planar_cuboid_approximation\n    up: [0, 0, 1]\n");
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

/// This hall looks the same from its other end: after many scans elsewhere nothing tells where it
/// is entered again.
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
    EXPECT_EQ(lost > 5, !pipeline.process(again).skip_reason.empty());
    if (lost == 1) EXPECT_NEAR(0.4, again.T_world_sensor.translation().x(), 0.03);
  }
}

}  // namespace
}  // namespace planar_mapping
