// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/drawing/projection_2d.h"

#include <gtest/gtest.h>

#include <map>

#include "evaluation/metrics/cuboid_geometry.h"
#include "planar_mapping/base/error.h"
#include "scenes.h"

namespace planar_mapping {
namespace {

// Only what is asked for, so that pixels can be told by their colour.
ViewOptions plain() {
  ViewOptions options;
  options.width = 320;
  options.height = 240;
  options.show = Layers::fromString("occupied,unknown");
  return options;
}

std::map<std::string, int> count(const Image& image) {
  std::map<std::string, int> pixels;
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const Color c = colorAt(image, column, row);
      const int sum = c.red + c.green + c.blue;
      const bool red = c.red > c.green + 60;
      pixels[red ? "path" : sum > 750 ? "free" : sum < 250 ? "occupied" : "unknown"]++;
    }
  }
  return pixels;
}

/// Four posts on the corners of a floor.
SceneContent post() {
  SceneContent content;
  content.cuboids.push_back(testing::plate({4.0, 3.0, 0.0}, {0, 0, 1}, 9.0, 7.0, 0));
  for (int i = 0; i < 4; ++i) {
    Cuboid cuboid =
        test::cuboidAt({i < 2 ? 0.0 : 8.0, i % 2 == 0 ? 0.0 : 6.0, 0.5}, {0.5, 0.5, 1.0});
    cuboid.plane_id = -1;
    content.cuboids.push_back(cuboid);
  }
  return content;
}

TEST(Projection2d, DrawsAreasToScale) {
  SceneContent content = post();
  Cuboid block = test::cuboidAt({4.0, 3.0, 0.5}, {3.0, 2.0, 1.0});
  block.plane_id = -1;
  content.cuboids.push_back(block);
  ViewOptions options = plain();
  options.width = 960;
  options.height = 720;
  auto with = count(drawProjection2d(content, options));
  content.cuboids.back().state = CellState::Unknown;
  content.unknown.push_back(content.cuboids.back());
  content.cuboids.pop_back();
  auto without = count(drawProjection2d(content, options));
  const double area = with["occupied"] - without["occupied"];
  EXPECT_GT(area, 100);
  // Four posts have 1 square metre, the block 6; all take the cells that they touch, up to 0.2 m
  // more along a side.
  const double ratio = area / without["occupied"];
  EXPECT_LE(ratio, 6.0 / 1.0);
  EXPECT_GE(ratio, 3.2 * 2.2 / (4.0 * 0.7 * 0.7));
  EXPECT_NEAR(without["unknown"] - with["unknown"], area, 0.1 * area);
}

TEST(Projection2d, LeavesTheCeilingOut) {
  SceneContent content = post();
  const auto before = count(drawProjection2d(content, plain()));
  content.cuboids.push_back(testing::plate({4, 3, 2.5}, {0, 0, -1}, 8, 6, 1));
  EXPECT_EQ(count(drawProjection2d(content, plain())), before);
}

TEST(Projection2d, KeepsNorthUp) {
  SceneContent content = post();
  content.cuboids.pop_back();  // the corner at (8, 6): upper right
  const Image image = drawProjection2d(content, plain());
  int upper_right = 0, lower_left = 0;
  for (int row = 0; row < image.height / 2; ++row) {
    for (int column = 0; column < image.width / 2; ++column) {
      if (colorAt(image, image.width - 1 - column, row).red < 100) ++upper_right;
      if (colorAt(image, column, image.height - 1 - row).red < 100) ++lower_left;
    }
  }
  EXPECT_EQ(upper_right, 0);
  EXPECT_GT(lower_left, 10);
}

TEST(Projection2d, DrawsPathGridRulersAndLegend) {
  ViewOptions options = plain();
  options.show = Layers::fromString("all");
  auto pixels = count(drawProjection2d(testing::room(), options));
  EXPECT_GT(pixels["path"], 20);
  EXPECT_GT(pixels["unknown"], 200);
  options.show.trajectory = false;
  EXPECT_EQ(count(drawProjection2d(testing::room(), options))["path"], 0);
}

TEST(Projection2d, IsTheSameEveryTime) {
  ViewOptions options;
  options.show.unknown = true;
  EXPECT_EQ(drawProjection2d(testing::room(), options).pixels,
            drawProjection2d(testing::room(), options).pixels);
}

TEST(Projection2d, RefusesWhatCannotBeDrawn) {
  EXPECT_THROW(drawProjection2d(SceneContent()), InputError);
  EXPECT_THROW(drawProjection2d(testing::room(), plain(), RobotModel(), 7), ParameterError);
}

TEST(Projection2d, CopesWithHugeCoordinatesAndZoom) {
  SceneContent content = post();
  for (Cuboid& cuboid : content.cuboids) cuboid.center.x() += 1e9;
  EXPECT_GT(count(drawProjection2d(content, plain()))["occupied"], 100);
  content.cuboids[0].center.x() = -1e9;
  EXPECT_NO_THROW(drawProjection2d(content, ViewOptions()));
  ViewOptions zoomed = plain();
  zoomed.zoom = 1000.0;
  zoomed.show = Layers::fromString("all");
  EXPECT_NO_THROW(drawProjection2d(testing::room(), zoomed));
}

}  // namespace
}  // namespace planar_mapping
