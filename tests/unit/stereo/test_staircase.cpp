// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Why the risers of a painted staircase are no planes: what stereo matching measures of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/stereo/stereo_matcher.h"

namespace planar_mapping {
namespace {

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
