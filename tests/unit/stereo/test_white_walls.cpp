// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Walls of one colour in simulated rooms, mapped by stereo_indoor.yaml. Seeds 101 to 106 chose the
// constants of matching and of assumed points; those here did not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "white_room.h"

namespace planar_mapping {
namespace {

constexpr int kFrames = 10;

class WhiteWalls : public testing::TestWithParam<int> {};

TEST_P(WhiteWalls, AreMappedWithoutPhantoms) {
  const test::WhiteWalk walk = test::walkWhiteRoom(static_cast<std::uint64_t>(GetParam()), kFrames);
  const PlanarMap map = test::mapOf(walk, "stereo_indoor.yaml");
  const test::WhiteRoomFigures figures = test::figuresOf(walk, map);
  std::printf("walls %.3f occupied; free %.4f occupied; %d cuboids behind, up to %.2f m\n",
              figures.walls_occupied, figures.free_occupied, figures.cuboids_behind,
              figures.farthest_behind);
  ASSERT_GT(figures.wall_points, 5000u);
  ASSERT_GT(figures.free_points, 10000u);
  EXPECT_GT(figures.walls_occupied, 0.85);
  EXPECT_LT(figures.free_occupied, 0.015);
  EXPECT_LT(figures.farthest_behind, 1.0);
}

/// Cameras that see far up, and no edge below the ceiling, which is 2.5 m high.
TEST_P(WhiteWalls, OverexposedOnesEndBelowTheCeiling) {
  test::WhiteWalk walk =
      test::walkWhiteRoom(static_cast<std::uint64_t>(GetParam()), kFrames, 250.0);
  test::overexpose(walk, 1.5);
  const PlanarMap map = test::mapOf(walk, "stereo_indoor.yaml");
  double highest = 0.0;
  for (const Cuboid& cuboid : map.cuboids()) {
    const Vector3 up = cuboid.orientation.conjugate() * Vector3::UnitZ();
    highest = std::max(highest, cuboid.center.z() + 0.5 * up.cwiseAbs().dot(cuboid.size));
  }
  const test::WhiteRoomFigures figures = test::figuresOf(walk, map);
  std::printf("walls %.3f occupied; cuboids up to %.2f m high\n", figures.walls_occupied, highest);
  EXPECT_GT(figures.walls_occupied, 0.7);
  EXPECT_LT(highest, 3.5);  // wrong matches reach 3 m
}

/// A disparity needs evidence: of what there is in these rooms little is wrong.
TEST_P(WhiteWalls, NoiseIsNoTexture) {
  const test::WhiteWalk walk = test::walkWhiteRoom(static_cast<std::uint64_t>(GetParam()), 3);
  const io::Calibration calibration = test::calibrationOf(walk);
  const double depth_of_one = calibration.camera.fx * *calibration.baseline;
  std::size_t found = 0;
  std::size_t bad = 0;
  for (const evaluation::SimulatedFrame& frame : walk.frames) {
    const DisparityImage disparity = StereoMatcher().match(frame.left, frame.right, calibration);
    for (std::size_t i = 0; i < disparity.values.size(); ++i) {
      if (std::isnan(disparity.values[i])) continue;
      const double truth = depth_of_one / static_cast<double>(frame.truth.depth[i]);
      ++found;
      bad += std::abs(static_cast<double>(disparity.values[i]) - truth) > 2.0 ? 1 : 0;
    }
  }
  EXPECT_GT(found, 100000u);
  EXPECT_LT(static_cast<double>(bad), 0.06 * static_cast<double>(found));
}

INSTANTIATE_TEST_SUITE_P(Seeds, WhiteWalls, testing::Values(201, 202));

}  // namespace
}  // namespace planar_mapping
