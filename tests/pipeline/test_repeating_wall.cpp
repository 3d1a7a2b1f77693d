// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Walls whose panels repeat: a camera that was lost seems to be where more of the known is seen.
#include <gtest/gtest.h>

#include "planar_mapping/pipeline/pipeline.h"
#include "stereo_images.h"

namespace planar_mapping {
namespace {

constexpr double kWall = 2.0;   // depth, metres
constexpr double kPanel = 2.5;  // metres
constexpr double kStep = 0.5;   // of the camera along the wall, metres
const PinholeCamera kCamera{250.0, 250.0, 159.5, 119.5, 320, 240};

/// The wall from \p x along it; the image is black in the dark, its depths are not.
Frame frameAt(std::size_t number, double x, bool is_dark) {
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
                  : static_cast<std::uint8_t>(test::wallTone(x + point.x(), point.y(), kPanel, 1)));
    }
  }
  frame.cloud = cloudOf(xyz, 320, 240);
  return frame;
}

Pipeline pipelineWithMotion() {
  StageTable table;
  registerBuiltinStages(table);
  return Pipeline(parseConfiguration(
      "version: 1\nstages:\n  - stage: key_features\n    detector: orb\n    registered: true\n"
      "  - stage: motion_estimation\n    poses: ignore\n  - stage: multi_plane_segmentation\n"
      "  - stage: planar_cuboid_approximation\n",
      "test", table));
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
    for (const auto& [placed, report] : pipeline.takePlacedAgain()) check(placed);
  }
  EXPECT_LE(4u, before);
}

/// Nothing would be known by a first image without features; but a camera may see none for long.
TEST(RepeatingWall, AnImageWithoutFeaturesBeginsTheMapOnlyWhereNoBetterOneFollows) {
  for (const std::size_t dark : {2, 5, 8}) {
    const std::size_t waits = std::min<std::size_t>(dark, 5);
    Pipeline pipeline = pipelineWithMotion();
    for (std::size_t i = 0; i <= waits; ++i) {
      Frame frame = frameAt(i, 0.1 * static_cast<double>(i), i < dark);
      EXPECT_EQ(i < waits, !pipeline.process(frame).skip_reason.empty()) << i << " of " << dark;
    }
  }
  Pipeline pipeline = pipelineWithMotion();
  Frame last = frameAt(0, 0.0, true);
  last.is_last = true;
  EXPECT_EQ("", pipeline.process(last).skip_reason);
}

}  // namespace
}  // namespace planar_mapping
