// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/detail/cell_probability.h"

#include <gtest/gtest.h>

#include <limits>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

CellMask maskOf(std::int32_t width, std::int32_t height, const std::string& cells) {
  CellMask mask;
  mask.width = width;
  mask.height = height;
  for (const char c : cells) mask.cells.push_back(c == '#' ? 1 : 0);
  return mask;
}

TEST(CellProbability, CellTakesTheMeanOfItsFeatures) {
  const auto p = cellProbabilities(maskOf(1, 1, "#"), {{0, 0, 0.2}, {0, 0, 0.8}}, 0.1);
  EXPECT_FLOAT_EQ(p[0], 0.5f);
}

TEST(CellProbability, SpreadsOutwardsFromCellsWithFeatures) {
  // 0.8 at the left end, 0.2 at the right end of a row of six.
  const auto p = cellProbabilities(maskOf(6, 1, "######"), {{0, 0, 0.8}, {5, 0, 0.2}}, 0.0);
  const std::vector<float> expected{0.8f, 0.8f, 0.8f, 0.2f, 0.2f, 0.2f};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_FLOAT_EQ(p[i], expected[i]) << i;
}

TEST(CellProbability, CellBetweenTwoTakesTheirMean) {
  const auto p = cellProbabilities(maskOf(3, 1, "###"), {{0, 0, 0.8}, {2, 0, 0.2}}, 0.0);
  EXPECT_FLOAT_EQ(p[1], 0.5f);
}

TEST(CellProbability, DiagonalCellsAreAdjacent) {
  const auto p = cellProbabilities(maskOf(2, 2, "#..#"), {{0, 0, 0.6}}, 0.0);
  EXPECT_FLOAT_EQ(p[3], 0.6f);
}

TEST(CellProbability, DoesNotSpreadAcrossAGap) {
  const auto p = cellProbabilities(maskOf(5, 1, "##.##"), {{0, 0, 0.9}}, 0.3);
  EXPECT_FLOAT_EQ(p[1], 0.9f);
  EXPECT_FLOAT_EQ(p[2], 0.0f);
  EXPECT_FLOAT_EQ(p[3], 0.3f);  // the dense support of its own part
  EXPECT_FLOAT_EQ(p[4], 0.3f);
}

TEST(CellProbability, FeaturesOutsideTheMaskDoNotCount) {
  CellMask mask = maskOf(2, 1, "#.");
  mask.a0 = 10;
  mask.b0 = -4;
  const auto p = cellProbabilities(
      mask, {{10, -4, 0.7}, {11, -4, 0.1}, {0, 0, 0.1}, {-2147483647, 2147483647, 0.1}}, 0.0);
  EXPECT_FLOAT_EQ(p[0], 0.7f);
  EXPECT_FLOAT_EQ(p[1], 0.0f);
}

TEST(CellProbability, MirroredMaskGivesMirroredResult) {
  const auto p = cellProbabilities(maskOf(4, 2, "####.###"), {{0, 0, 0.9}, {2, 1, 0.4}}, 0.5);
  const auto q = cellProbabilities(maskOf(4, 2, "#######."), {{3, 0, 0.9}, {1, 1, 0.4}}, 0.5);
  for (int b = 0; b < 2; ++b) {
    for (int a = 0; a < 4; ++a) EXPECT_FLOAT_EQ(p[4 * b + a], q[4 * b + 3 - a]);
  }
}

TEST(CellProbability, AcceptsAnEmptyMask) {
  EXPECT_TRUE(cellProbabilities(CellMask(), {}, 0.5).empty());
}

TEST(CellProbability, RejectsBadArguments) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(cellProbabilities(maskOf(1, 1, "#"), {{0, 0, nan}}, 0.5), ParameterError);
  EXPECT_THROW(cellProbabilities(maskOf(1, 1, "#"), {}, 1.5), ParameterError);
  EXPECT_THROW(cellProbabilities(maskOf(2, 2, "#"), {}, 0.5), InputError);
}

TEST(CellProbability, DenseSupportIsTheMeanOverThePlanesPoints) {
  // One cell with two points 0.1 m apart in range, one alone in another cell.
  const std::vector<float> xyz{0.01f, 0, 2.01f, 0.01f, 0, 2.09f, 0.5f, 0, 2.05f};
  const PointsView points(xyz.data(), 3);
  const OccupancyParams params;
  const auto pair = featureProbabilities(points, nullptr, {0, 0, 1}, params);
  EXPECT_NEAR(denseSupportProbability(points, nullptr, 0.1, params),
              (pair[0] + pair[1] + 0.5) / 3.0, 1e-6);
  EXPECT_EQ(denseSupportProbability(PointsView(), nullptr, 0.1, params), 0.0);
}

TEST(SpreadToPoints, PointsTakeTheProbabilityOfTheFeaturesAroundThem) {
  const std::vector<float> xyz{0.05f, 0.05f, 1.05f,   // feature, cell 0
                               0.06f, 0.05f, 1.05f,   // same cell
                               0.15f, 0.05f, 1.05f,   // next cell
                               0.25f, 0.05f, 1.05f,   // the one after
                               0.95f, 0.05f, 1.05f,   // out of reach
                               0.16f, 0.06f, 1.05f};  // next cell, another plane
  const std::vector<std::int32_t> labels{0, 0, 0, 0, 0, 1};
  const auto p = spreadToPoints({xyz.data(), 6}, nullptr, &labels, 0.1, {0.8f, -1, -1, -1, -1, -1});
  EXPECT_FLOAT_EQ(p[0], 0.8f);
  EXPECT_FLOAT_EQ(p[1], 0.8f);
  EXPECT_FLOAT_EQ(p[2], 0.8f);
  EXPECT_FLOAT_EQ(p[3], 0.8f);
  EXPECT_FLOAT_EQ(p[4], -1.0f);
  EXPECT_FLOAT_EQ(p[5], -1.0f);
}

TEST(SpreadToPoints, NonFinitePointsGetZero) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> xyz{nan, 0, 0, 0, 0, 1};
  const auto p = spreadToPoints({xyz.data(), 2}, nullptr, nullptr, 0.1, {-1.0f, 0.5f});
  EXPECT_EQ(p[0], 0.0f);
  EXPECT_EQ(p[1], 0.5f);
  EXPECT_THROW(spreadToPoints({xyz.data(), 2}, nullptr, nullptr, 0.1, {0.5f}), InputError);
  EXPECT_THROW(spreadToPoints({xyz.data(), 2}, nullptr, nullptr, 0.1, {nan, 0.5f}), ParameterError);
}

}  // namespace
}  // namespace planar_mapping
