// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Walls of one colour in simulated rooms, mapped by stereo_indoor.yaml. Seeds 101 to 106 chose the
// constants of matching and of assumed points; those here did not.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/stereo/matching/stereo_matcher.h"
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
  EXPECT_LT(figures.free_occupied, 0.005);
  EXPECT_LT(figures.farthest_behind, 0.45);
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

INSTANTIATE_TEST_SUITE_P(Seeds, WhiteWalls, testing::Values(201, 202, 203));

// Why the risers of a painted staircase are no planes: what stereo matching measures of them.

/// A piece of a riser that no rail or post covers in the left image: corners in order, pixels.
struct Piece {
  const char* name;
  std::array<std::array<int, 2>, 4> corners;

  bool holds(int column, int row) const {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto& a = corners[i];
      const auto& b = corners[(i + 1) % corners.size()];
      if ((b[0] - a[0]) * (row - a[1]) < (b[1] - a[1]) * (column - a[0])) return false;
    }
    return true;
  }
};

/// Pixels of a piece, and the most that lie within 1.5 px of one upright plane, the disparity of
/// which is the same down each column: d = d0 + slope * (column - 1000).
struct Count {
  int pixels = 0;
  int agreeing = 0;
};

Count measured(const Piece& piece, const DisparityImage& disparity) {
  Count count;
  std::vector<std::array<double, 2>> found;  // column - 1000, disparity
  for (int row = 560; row < disparity.height; ++row) {
    for (int column = 700; column < disparity.width; ++column) {
      if (!piece.holds(column, row)) continue;
      ++count.pixels;
      const double d = disparity.at(column, row);
      if (std::isfinite(d)) found.push_back({column - 1000.0, d});
    }
  }
  for (double slope = 0.0; slope < 0.13; slope += 0.02) {
    for (double d0 = 30.0; d0 < 95.0; d0 += 0.5) {
      const auto agrees = [&](const std::array<double, 2>& at) {
        return std::fabs(at[1] - d0 - slope * at[0]) <= 1.5;
      };
      const auto n = std::count_if(found.begin(), found.end(), agrees);
      count.agreeing = std::max(count.agreeing, static_cast<int>(n));
    }
  }
  return count;
}

TEST(Staircase, HardlyAnyOfTheRisersIsMeasured) {
  const std::string set =
      PLANAR_MAPPING_SOURCE_DIR "/../shared/data/stereo_middlebury_2014/staircase";
  if (!std::filesystem::exists(set)) GTEST_SKIP() << "no " << set;
  const DisparityImage disparity = StereoMatcher().match(io::readImage(set + "/left/000000.png"),
                                                         io::readImage(set + "/right/000000.png"),
                                                         io::readCalibration(set + "/calib.yaml"));
  // Beside rail and post lies what the right camera does not see; the rest is even paint.
  const Piece pieces[] = {
      {"lower, left of the rail", {{{700, 716}, {815, 760}, {768, 820}, {700, 792}}}},
      {"lower, rail to post", {{{873, 782}, {1081, 868}, {1081, 935}, {818, 850}}}},
      {"upper, left of the rail", {{{773, 593}, {919, 630}, {870, 692}, {780, 667}}}},
      {"upper, rail to post", {{{978, 643}, {1085, 668}, {1083, 764}, {923, 714}}}},
      {"upper, beyond the bars", {{{1320, 730}, {1354, 738}, {1308, 834}, {1263, 820}}}},
      {"upper, post to first bar", {{{1148, 688}, {1180, 696}, {1178, 794}, {1147, 787}}}},
  };
  for (const Piece& piece : pieces) {
    const Count count = measured(piece, disparity);
    ASSERT_GT(count.pixels, 3000) << piece.name;
    EXPECT_LT(count.agreeing, 0.35 * count.pixels) << piece.name;
  }
}

}  // namespace
}  // namespace planar_mapping
