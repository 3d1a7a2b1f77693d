// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <vtkBillboardTextActor3D.h>
#include <vtkCoordinate.h>
#include <vtkPropCollection.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkTextRenderer.h>

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/viewer/scene/camera.h"
#include "planar_mapping/viewer/scene/colors.h"
#include "planar_mapping/viewer/scene/scene.h"
#include "planar_mapping/viewer/scene/view_options.h"
#include "planar_mapping/viewer/window/image.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

TEST(Layers, ShowsWhatIsNamedAndNothingElse) {
  const Layers layers = Layers::fromString("occupied,ground-grid");
  EXPECT_TRUE(layers.occupied);
  EXPECT_TRUE(layers.ground_grid);
  EXPECT_FALSE(layers.unknown || layers.trajectory || layers.cloud || layers.edges || layers.axes ||
               layers.legend);
}

TEST(Layers, KnowsAllAndNone) {
  const Layers all = Layers::fromString("all");
  EXPECT_TRUE(all.occupied && all.unknown && all.trajectory && all.cloud && all.edges && all.axes &&
              all.ground_grid && all.legend);
  const Layers none = Layers::fromString("none");
  EXPECT_FALSE(none.occupied || none.unknown || none.legend);
}

TEST(Layers, RefusesAnUnknownWord) {
  EXPECT_THROW(Layers::fromString("occupied,egdes"), ParameterError);
  EXPECT_THROW(Layers::fromString("occupied,,edges"), ParameterError);
}

TEST(ViewOptions, ReadsASize) {
  ViewOptions options;
  options.setSize("640x480");
  EXPECT_EQ(options.width, 640);
  EXPECT_EQ(options.height, 480);
  for (const char* bad : {"", "640", "640x", "x480", "640x480x3", "15x480", "640x16385", "640X480",
                          "-640x480", "16384x16384", "99999x99999", "640x48O"}) {
    EXPECT_THROW(options.setSize(bad), ParameterError) << bad;
  }
  EXPECT_EQ(options.width, 640) << "a bad size must not change anything";
}

TEST(ViewOptions, RefusesWhatIsNotFinite) {
  ViewOptions options;
  options.camera_position = Vector3(0.0, NAN, 0.0);
  EXPECT_THROW(options.validate(), ParameterError);
  options = ViewOptions();
  options.zoom = NAN;
  EXPECT_THROW(options.validate(), ParameterError);
  options.zoom = 0.0;
  EXPECT_THROW(options.validate(), ParameterError);
  options = ViewOptions();
  options.view_up = Vector3::Zero();
  EXPECT_THROW(options.validate(), ParameterError);
  options = ViewOptions();
  options.clip_above = INFINITY;
  EXPECT_THROW(options.validate(), ParameterError);
  options = ViewOptions();
  options.point_size = 0.0;
  EXPECT_THROW(options.validate(), ParameterError);
}

TEST(Words, RoundTrip) {
  for (const char* word : {"iso", "top", "front", "back", "left", "right", "first-person"})
    EXPECT_STREQ(toString(cameraPresetFromString(word)), word);
  for (const char* word : {"none", "ceiling", "seen"})
    EXPECT_STREQ(toString(cutawayFromString(word)), word);
  EXPECT_THROW(cameraPresetFromString("isometric"), ParameterError);
}

Image filled(int width, int height, Color color) {
  Image image{width, height, 3, {}};
  for (int i = 0; i < width * height; ++i)
    image.pixels.insert(image.pixels.end(), {color.red, color.green, color.blue});
  return image;
}

void set(Image& image, int column, int row, Color color) {
  std::uint8_t* p = &image.pixels[static_cast<std::size_t>(3 * (row * image.width + column))];
  p[0] = color.red;
  p[1] = color.green;
  p[2] = color.blue;
}

Image pattern() {
  Image image = filled(7, 5, {10, 20, 30});
  for (int row = 0; row < 5; ++row) {
    for (int column = 0; column < 7; ++column) {
      set(image, column, row,
          {static_cast<std::uint8_t>(30 * column), static_cast<std::uint8_t>(50 * row), 200});
    }
  }
  return image;
}

TEST(ColorAt, CountsRowsFromTheTop) {
  EXPECT_EQ(colorAt(pattern(), 6, 1), (Color{180, 50, 200}));
}

TEST(IsBlank, SeesASinglePixel) {
  Image image = filled(40, 30, {200, 210, 220});
  EXPECT_TRUE(isBlank(image));
  set(image, 39, 29, {200, 210, 224});
  EXPECT_FALSE(isBlank(image));
  set(image, 39, 29, {202, 210, 218});
  EXPECT_TRUE(isBlank(image)) << "rounding noise is not a picture";
  EXPECT_TRUE(isBlank(Image()));
}

TEST(CompareImages, CountsChangedPixels) {
  const Image a = filled(10, 10, {100, 100, 100});
  Image b = a;
  EXPECT_EQ(compareImages(a, b).changed, 0.0);
  set(b, 3, 4, {100, 117, 100});
  set(b, 5, 4, {100, 116, 100});
  EXPECT_DOUBLE_EQ(compareImages(a, b).changed, 0.01);
  EXPECT_NEAR(compareImages(a, b).mean, 33.0 / (255.0 * 300.0), 1e-12);
  EXPECT_THROW(compareImages(a, filled(10, 9, {})), InputError);
}

TEST(Png, ReadsBackWhatWasWritten) {
  const TemporaryDirectory dir;
  io::writeImage(dir / "a.png", pattern());
  const Image back = readPng(dir / "a.png");
  EXPECT_EQ(back.width, 7);
  EXPECT_EQ(back.height, 5);
  EXPECT_EQ(back.pixels, pattern().pixels);
  EXPECT_THROW(io::writeImage(dir / "a.png", filled(3, 3, {})), IoError);
  EXPECT_EQ(readPng(dir / "a.png").width, 7);
  io::writeImage(dir / "a.png", filled(3, 3, {}), io::Overwrite::Allow);
  EXPECT_EQ(readPng(dir / "a.png").width, 3);
}

TEST(Png, AGrayFileHasThreeEqualChannels) {
  const TemporaryDirectory dir;
  io::writeImage(dir / "gray.png", {2, 1, 1, {7, 200}});
  EXPECT_EQ(readPng(dir / "gray.png").pixels, (std::vector<std::uint8_t>{7, 7, 7, 200, 200, 200}));
}

int apart(Color a, Color b) {
  return std::abs(a.red - b.red) + std::abs(a.green - b.green) + std::abs(a.blue - b.blue);
}

TEST(PlaneColor, TellsNeighbouringIdsApart) {
  for (int id = 0; id < 200; ++id) {
    for (int next = 1; next <= 3; ++next)
      EXPECT_GT(apart(planeColor(id), planeColor(id + next)), 50) << id << " " << id + next;
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
  for (const char* bad : {"", "#12345", "#12345g", "whit", "#1234567", "0180ff"})
    EXPECT_THROW(colorFromString(bad), ParameterError) << bad;
}

TEST(ColorByFromString, KnowsEveryWordAndNamesThemOtherwise) {
  for (const char* word : {"plane", "height", "probability", "state", "tilt"})
    EXPECT_STREQ(toString(colorByFromString(word)), word);
  try {
    colorByFromString("heigth");
    FAIL();
  } catch (const ParameterError& error) {
    EXPECT_NE(std::string(error.what()).find("'heigth'"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("height"), std::string::npos);
  }
}

struct Text {
  std::string words;
  double left, right, bottom, top;
};

/// Where the texts of the scene are, as VTK's fonts measure them.
std::vector<Text> textsOf(vtkRenderer* renderer, int width, int height, const CameraView& view) {
  constexpr int kDotsPerInch = 72;
  std::vector<Text> texts;
  vtkPropCollection* props = renderer->GetViewProps();
  props->InitTraversal();
  while (vtkProp* prop = props->GetNextProp()) {
    std::string words;
    vtkTextProperty* style = nullptr;
    double x = 0.0;
    double y = 0.0;
    if (auto* flat = vtkTextActor::SafeDownCast(prop)) {
      words = flat->GetInput();
      style = flat->GetTextProperty();
      x = flat->GetPosition()[0];
      y = flat->GetPosition()[1];
    } else if (auto* standing = vtkBillboardTextActor3D::SafeDownCast(prop)) {
      words = standing->GetInput();
      style = standing->GetTextProperty();
      const Vector3 at(standing->GetPosition());
      // The scene's origin is the middle of its content, here the world's.
      const Vector3 to = at - view.position;
      const double scale =
          0.5 * height /
          (view.parallel ? view.parallel_scale
                         : to.dot(view.direction()) * std::tan(0.5 * view.view_angle));
      x = 0.5 * width + scale * to.dot(view.direction().cross(view.view_up));
      y = 0.5 * height + scale * to.dot(view.view_up);
    } else {
      continue;
    }
    int box[4] = {0, 0, 0, 0};
    vtkTextRenderer::GetInstance()->GetBoundingBox(style, words, box, kDotsPerInch);
    texts.push_back({words, x + box[0], x + box[1], y + box[2], y + box[3]});
  }
  return texts;
}

/// A room around the origin: planes of many heights, and unknown space.
SceneContent room() {
  SceneContent content;
  for (int i = -4; i <= 4; ++i) {
    Cuboid cuboid;
    cuboid.center = Vector3(2.0 * i, 0.7 * i, 0.2 * i);
    cuboid.size = Vector3(1.5, 3.0, 0.1);
    cuboid.plane_id = i == 0 ? -1 : i + 5;
    content.cuboids.push_back(cuboid);
  }
  content.unknown.push_back(content.cuboids.front());
  content.resolution = 0.05;
  content.trajectory.push_back(Pose::Identity());
  return content;
}

TEST(Captions, NeverMeetInAnyPicture) {
  const SceneContent content = room();
  const int sizes[][2] = {{1280, 720}, {640, 480}, {320, 240}, {200, 400}, {160, 120}, {64, 64}};
  std::size_t shown = 0;
  for (const auto& size : sizes) {
    for (const CameraPreset camera : {CameraPreset::Iso, CameraPreset::Top, CameraPreset::Front}) {
      for (const ColorBy color : {ColorBy::Plane, ColorBy::Height, ColorBy::Probability}) {
        ViewOptions options;
        options.width = size[0];
        options.height = size[1];
        options.camera = camera;
        options.color = color;
        options.show.unknown = true;
        visualization::Scene scene(content);
        scene.show(options);
        scene.look(placeCamera(content, options));
        const std::vector<Text> texts = textsOf(scene.renderer(), size[0], size[1], scene.camera());
        shown += texts.size();
        for (std::size_t i = 0; i < texts.size(); ++i) {
          for (std::size_t k = 0; k < i; ++k) {
            const Text& a = texts[i];
            const Text& b = texts[k];
            const bool meet =
                a.left < b.right && b.left < a.right && a.bottom < b.top && b.bottom < a.top;
            EXPECT_FALSE(meet) << "'" << a.words << "' meets '" << b.words << "' at " << size[0]
                               << "x" << size[1];
          }
        }
      }
    }
  }
  EXPECT_GT(shown, 300u);  // large pictures keep theirs
}

}  // namespace
}  // namespace planar_mapping
