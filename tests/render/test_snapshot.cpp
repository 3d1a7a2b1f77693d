// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "comma_locale.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/viewer/scene/camera.h"
#include "planar_mapping/viewer/scene/picking.h"
#include "planar_mapping/viewer/window/snapshot.h"
#include "scenes.h"

namespace planar_mapping {
namespace {

// Cuboids alone on black: whatever is not black belongs to them.
ViewOptions bare(int width = 320, int height = 240) {
  ViewOptions options;
  options.width = width;
  options.height = height;
  options.show = Layers::fromString("occupied");
  options.background = Color{0, 0, 0};
  return options;
}

bool isDrawn(Color c) {
  return c.red + c.green + c.blue > 60;
}

double fraction(const Image& image) {
  std::size_t drawn = 0;
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column)
      drawn += isDrawn(colorAt(image, column, row));
  }
  return static_cast<double>(drawn) / (static_cast<double>(image.width) * image.height);
}

TEST(Snapshot, DrawsFullLengths) {
  // 4 x 2 m seen from above: the picture is scaled to its 4 m across (4:3), so that it fills
  // 1 / 1.08 of the width and 2 / 3 of that of the height.
  SceneContent content;
  content.cuboids.push_back(testing::plate({0, 0, 0}, {0, 0, 1}, 4.0, 2.0, 0));
  ViewOptions options = bare();
  options.camera = CameraPreset::Top;
  EXPECT_NEAR(fraction(renderSnapshot(content, options)), (1.0 / 1.08) * (2.0 / 3.0) / 1.08, 0.02);
}

TEST(Snapshot, TurnsCuboidsTheRightWay) {
  // The picture of one long box, turned by a general rotation, has to agree with the ray test:
  // a quaternion in the wrong order, or a transposed one, does not.
  SceneContent content;
  Cuboid cuboid;
  cuboid.size = {3.0, 0.8, 0.4};
  cuboid.orientation = Quaternion(Eigen::AngleAxisd(0.7, Vector3(0.3, -0.5, 0.8).normalized()));
  cuboid.center = {100.0, -50.0, 3.0};
  content.cuboids.push_back(cuboid);
  for (const CameraPreset preset : {CameraPreset::Iso, CameraPreset::Top, CameraPreset::Left}) {
    ViewOptions options = bare();
    options.camera = preset;
    const Image image = renderSnapshot(content, options);
    const CameraView view = placeCamera(content, options);
    int differing = 0, covered = 0;
    for (int row = 0; row < image.height; ++row) {
      for (int column = 0; column < image.width; ++column) {
        const Ray ray = sightLine(view, image.width, image.height, column + 0.5, row + 0.5);
        const bool hit = enters(ray, cuboid) >= 0.0;
        covered += hit;
        differing += hit != isDrawn(colorAt(image, column, row));
      }
    }
    EXPECT_GT(covered, 3000) << toString(preset);
    EXPECT_LT(differing, 0.03 * covered) << toString(preset);
  }
}

TEST(Snapshot, CutsAwayWhatThePickIgnores) {
  SceneContent content = testing::room();
  for (const Cutaway cutaway : {Cutaway::None, Cutaway::Ceiling, Cutaway::Seen}) {
    ViewOptions options = bare();
    options.cutaway = cutaway;
    options.color = ColorBy::Plane;
    const Image image = renderSnapshot(content, options);
    const CameraView view = placeCamera(content, options);
    int differing = 0;
    for (int row = 0; row < image.height; row += 2) {
      for (int column = 0; column < image.width; column += 2) {
        const Ray ray = sightLine(view, image.width, image.height, column + 0.5, row + 0.5);
        const bool hit = pickCuboid(content, ray, view, options) >= 0;
        differing += hit != isDrawn(colorAt(image, column, row));
      }
    }
    EXPECT_LT(differing, 0.03 * 160 * 120) << toString(cutaway);
  }
}

TEST(Snapshot, SaysWhatTheCutawayLeavesOut) {
  SceneContent content;
  content.cuboids.push_back(testing::plate({0, 0, 0}, {0, 0, 1}, 2.0, 2.0, 5));
  ViewOptions options = bare();
  options.show.legend = true;
  const auto with = [&](Cutaway cutaway) {
    options.cutaway = cutaway;
    return renderSnapshot(content, options);
  };
  // Nothing faces down or away here: the pictures differ by the words below them alone.
  const Image none = with(Cutaway::None);
  const Image ceiling = with(Cutaway::Ceiling);
  const Image seen = with(Cutaway::Seen);
  const auto differing = [](const Image& a, const Image& b, int first_row, int last_row) {
    int count = 0;
    for (int row = first_row; row < last_row; ++row) {
      for (int column = 0; column < a.width; ++column)
        count += !(colorAt(a, column, row) == colorAt(b, column, row));
    }
    return count;
  };
  const int words = none.height * 5 / 6;
  for (const Image* other : {&ceiling, &seen}) {
    EXPECT_EQ(differing(none, *other, 0, words), 0);
    EXPECT_GT(differing(none, *other, words, none.height), 50);
  }
  EXPECT_GT(differing(ceiling, seen, words, none.height), 50);
  content.cuboids[0].plane_id = -1;  // boxes are never cut away
  EXPECT_EQ(differing(with(Cutaway::None), with(Cutaway::Seen), 0, none.height), 0);
}

TEST(Snapshot, GivesEachPlaneItsColor) {
  SceneContent content;
  content.cuboids.push_back(testing::plate({0, 0, 0}, {0, 0, 1}, 2.0, 2.0, 5));
  ViewOptions options = bare();
  options.camera = CameraPreset::Top;
  const Color c = colorAt(renderSnapshot(content, options), 160, 120);
  const Color expected = planeColor(5);
  // Shading scales the channels alike.
  EXPECT_NEAR(1.0 * c.red / c.green, 1.0 * expected.red / expected.green, 0.05);
  EXPECT_NEAR(1.0 * c.blue / c.green, 1.0 * expected.blue / expected.green, 0.05);
}

TEST(Snapshot, RunsHeightColorsOverAFace) {
  SceneContent content;
  content.cuboids.push_back(testing::plate({0, 0, 1.0}, {0, -1, 0}, 2.0, 2.0, 0));
  ViewOptions options = bare(240, 240);
  options.camera = CameraPreset::Front;
  options.color = ColorBy::Height;
  const Image image = renderSnapshot(content, options);
  const Color top = colorAt(image, 120, 15), bottom = colorAt(image, 120, 225);
  EXPECT_GT(bottom.blue, bottom.red + 40) << "low is blue";
  EXPECT_GT(top.red, top.blue + 40) << "high is red";
}

TEST(Snapshot, IsTheSameEveryTime) {
  const Image first = renderSnapshot(testing::room(), ViewOptions());
  EXPECT_EQ(renderSnapshot(testing::room(), ViewOptions()).pixels, first.pixels);
}

TEST(Snapshot, IsTheSameFarFromTheOrigin) {
  SceneContent content = testing::room();
  const Image near = renderSnapshot(content, bare());
  for (Cuboid& cuboid : content.cuboids) cuboid.center += Vector3(1e6, -1e6, 0.0);
  for (Pose& pose : content.trajectory) pose.pretranslate(Vector3(1e6, -1e6, 0.0));
  EXPECT_LT(compareImages(renderSnapshot(content, bare()), near).changed, 0.01);
}

TEST(Snapshot, DrawsEveryLayerAndMode) {
  SceneContent content = testing::room();
  content.clouds.push_back(
      {{1.0f, 1.0f, 1.0f, 2.0f, 1.0f, 1.0f, NAN, 0.0f, 0.0f}, {255, 0, 0, 0, 255, 0, 0, 0, 255}});
  ViewOptions options;
  options.width = 320;
  options.height = 240;
  for (const char* color : {"plane", "height", "probability", "state", "tilt"}) {
    options.color = colorByFromString(color);
    options.show = Layers::fromString("all");
    EXPECT_NO_THROW(renderSnapshot(content, options)) << color;
  }
  const Image all = renderSnapshot(content, options);
  for (const char* layer : {"unknown", "trajectory", "axes", "edges", "ground-grid", "legend"}) {
    std::string rest;
    for (const char* other :
         {"occupied", "unknown", "trajectory", "axes", "edges", "ground-grid", "legend"}) {
      if (std::string(other) != layer) rest += (rest.empty() ? "" : ",") + std::string(other);
    }
    options.show = Layers::fromString(rest);
    EXPECT_GT(compareImages(renderSnapshot(content, options), all).changed, 0.0) << layer;
  }
}

TEST(Snapshot, DrawsACloudAlone) {
  SceneContent content;
  SceneCloud cloud;
  for (int i = 0; i < 1000; ++i) {
    for (const double v : {0.01 * i, std::sin(0.02 * i), 0.5})
      cloud.xyz.push_back(static_cast<float>(v));
  }
  content.clouds.push_back(cloud);
  ViewOptions options = bare();
  options.show = Layers::fromString("cloud");
  options.background = Color{255, 255, 255};
  EXPECT_FALSE(isBlank(renderSnapshot(content, options)));
}

TEST(Snapshot, RefusesABlankPicture) {
  ViewOptions options = bare();
  options.camera_position = Vector3(100, 100, 100);
  options.focal_point = Vector3(200, 200, 200);
  try {
    renderSnapshot(testing::room(), options);
    FAIL() << "looked away from everything";
  } catch (const RenderError& error) {
    EXPECT_NE(std::string(error.what()).find("blank"), std::string::npos) << error.what();
  }
}

TEST(Snapshot, RefusesAnEmptyScene) {
  EXPECT_THROW(renderSnapshot(SceneContent(), ViewOptions()), InputError);
}

TEST(Snapshot, SurvivesDegenerateCuboids) {
  SceneContent content = testing::room();
  content.cuboids[0].size.setZero();
  content.cuboids[1].size.z() = 0.0;
  Cuboid far;
  far.center = {1e9, 0.0, 0.0};
  content.cuboids.push_back(far);
  try {
    renderSnapshot(content, ViewOptions());
  } catch (const RenderError&) {
    // Two things 1e9 m apart may well be too small to see.
  }
}

TEST(Snapshot, DoesNotDependOnTheLocale) {
  for (const char* color : {"plane", "height"}) {
    ViewOptions options = bare();
    options.show = Layers::fromString("all");
    options.color = colorByFromString(color);
    const Image expected = renderSnapshot(testing::room(), options);
    const test::CommaLocale locale;
    EXPECT_EQ(renderSnapshot(testing::room(), options).pixels, expected.pixels) << color;
  }
}

TEST(Snapshot, NeedsNoEnvironment) {
  ::setenv("DISPLAY", ":77", 1);  // a dead one must not matter
  ::unsetenv("HOME");
  EXPECT_NO_THROW(renderSnapshot(testing::room(), bare()));
  ::unsetenv("DISPLAY");
  EXPECT_NO_THROW(renderSnapshot(testing::room(), bare()));
}

}  // namespace
}  // namespace planar_mapping
