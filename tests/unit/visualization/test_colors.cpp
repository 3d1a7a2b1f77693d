// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/colors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

int apart(Color a, Color b) {
  return std::abs(a.red - b.red) + std::abs(a.green - b.green) + std::abs(a.blue - b.blue);
}

TEST(PlaneColor, DependsOnTheIdAlone) {
  for (int id = 0; id < 100; ++id) EXPECT_EQ(planeColor(id), planeColor(id));
}

TEST(PlaneColor, TellsNeighbouringIdsApart) {
  for (int id = 0; id < 200; ++id) {
    for (int next = 1; next <= 3; ++next) {
      EXPECT_GT(apart(planeColor(id), planeColor(id + next)), 50) << id << " " << id + next;
    }
  }
}

TEST(PlaneColor, DrawsNonPlanarCellsGray) {
  const Color c = planeColor(-1);
  EXPECT_LT(std::abs(c.red - c.blue), 12);
  EXPECT_LT(std::abs(c.red - c.green), 12);
  for (int id = 0; id < 50; ++id) EXPECT_GT(apart(planeColor(id), c), 40) << id;
}

TEST(PlaneColor, TakesTheLargestId) {
  EXPECT_NE(planeColor(2147483647), planeColor(-1));
}

TEST(ScaleColor, HasViridisEndsForTilt) {
  EXPECT_EQ(scaleColor(ColorBy::Tilt, 0.0), (Color{68, 1, 84}));
  EXPECT_EQ(scaleColor(ColorBy::Tilt, 1.0), (Color{253, 231, 37}));
  EXPECT_EQ(scaleColor(ColorBy::Tilt, 0.5), (Color{33, 145, 140}));
}

TEST(ScaleColor, InterpolatesBetweenItsPoints) {
  // A sixteenth lies half way between the first two of nine points.
  EXPECT_EQ(scaleColor(ColorBy::Tilt, 1.0 / 16.0), (Color{70, 23, 104}));
}

TEST(ScaleColor, ClampsAndSurvivesNan) {
  EXPECT_EQ(scaleColor(ColorBy::Probability, -5.0), scaleColor(ColorBy::Probability, 0.0));
  EXPECT_EQ(scaleColor(ColorBy::Probability, INFINITY), scaleColor(ColorBy::Probability, 1.0));
  EXPECT_EQ(scaleColor(ColorBy::Height, NAN), scaleColor(ColorBy::Height, 0.0));
}

TEST(ScalarRange, MapsItsEndsToZeroAndOne) {
  const ScalarRange range{-2.0, 6.0};
  EXPECT_DOUBLE_EQ(range.normalized(-2.0), 0.0);
  EXPECT_DOUBLE_EQ(range.normalized(0.0), 0.25);
  EXPECT_DOUBLE_EQ(range.normalized(100.0), 1.0);
  EXPECT_DOUBLE_EQ((ScalarRange{3.0, 3.0}.normalized(3.0)), 0.0);
}

TEST(ColorFromString, ReadsNamesAndHex) {
  EXPECT_EQ(colorFromString("#0180ff"), (Color{1, 128, 255}));
  EXPECT_EQ(colorFromString("white"), (Color{255, 255, 255}));
  for (const char* bad : {"", "#12345", "#12345g", "whit", "#1234567", "0180ff"}) {
    EXPECT_THROW(colorFromString(bad), ParameterError) << bad;
  }
}

TEST(ColorByFromString, KnowsEveryWordAndNamesThemOtherwise) {
  for (const char* word : {"plane", "height", "probability", "state", "tilt"}) {
    EXPECT_STREQ(toString(colorByFromString(word)), word);
  }
  try {
    colorByFromString("heigth");
    FAIL();
  } catch (const ParameterError& error) {
    EXPECT_NE(std::string(error.what()).find("'heigth'"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("height"), std::string::npos);
  }
}

}  // namespace
}  // namespace planar_mapping
