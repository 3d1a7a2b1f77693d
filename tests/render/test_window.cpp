// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "planar_mapping/base/error.h"
#include "planar_mapping/viewer/scene/picking.h"
#include "planar_mapping/viewer/window/snapshot.h"
#include "planar_mapping/viewer/window/window.h"
#include "scenes.h"
#include "x_server.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

ViewOptions small() {
  ViewOptions options;
  options.width = 400;
  options.height = 300;
  return options;
}

// A pixel at which the picked cuboid is the wanted one.
bool findPixel(const SceneContent& content, const Window& window, int wanted, int& x, int& y) {
  const ViewOptions& o = window.options();
  for (y = 0; y < o.height; y += 3) {
    for (x = 0; x < o.width; x += 3) {
      const Ray ray = sightLine(window.camera(), o.width, o.height, x + 0.5, y + 0.5);
      if (pickCuboid(content, ray, window.camera(), o) == wanted) return true;
    }
  }
  return false;
}

int tableTop(const SceneContent& content) {
  for (std::size_t i = 0; i < content.cuboids.size(); ++i) {
    if (content.cuboids[i].plane_id == 6) return static_cast<int>(i);
  }
  return -1;
}

// The same session for both kinds of screen: keys and clicks through VTK's events.
void useWindow(Window::Screen screen) {
  const SceneContent content = testing::room();
  const std::unique_ptr<Window> opened = openWindow(content, small(), screen);
  Window& window = *opened;
  const Image first = window.image();
  EXPECT_FALSE(isBlank(first));

  window.sendKey("h");
  EXPECT_EQ(window.overlayText(), Window::keyHelp());
  EXPECT_GT(compareImages(window.image(), first).changed, 0.05) << "the help is on the picture";
  window.sendKey("h");
  EXPECT_EQ(window.overlayText(), "");

  for (const ColorBy color :
       {ColorBy::Height, ColorBy::Probability, ColorBy::State, ColorBy::Tilt, ColorBy::Plane}) {
    window.sendKey("c");
    EXPECT_EQ(window.options().color, color);
    EXPECT_EQ(window.overlayText(), std::string("colour by ") + toString(color));
  }

  window.sendKey("2");
  EXPECT_TRUE(window.camera().parallel);
  EXPECT_NEAR(window.camera().direction().z(), -1.0, 1e-6);
  window.sendKey("1");
  EXPECT_FALSE(window.camera().parallel);

  window.sendKey("u");
  EXPECT_TRUE(window.options().show.unknown);
  EXPECT_EQ(window.overlayText(), "unknown space shown");
  window.sendKey("u");

  const int table = tableTop(content);
  int x = 0, y = 0;
  ASSERT_TRUE(findPixel(content, window, table, x, y));
  window.sendClick(x, y);
  EXPECT_EQ(window.overlayText(), describeCuboid(content, table));
  EXPECT_NE(window.overlayText().find("plane 6"), std::string::npos);
  EXPECT_NE(window.overlayText().find("1.600 x 0.800 x 0.050 m"), std::string::npos);
  window.sendClick(2, 2);
  EXPECT_EQ(window.overlayText(), "nothing there");
  window.sendKey("Escape");
  EXPECT_EQ(window.overlayText(), "");
  EXPECT_FALSE(window.press("F7")) << "means nothing";
}

TEST(Window, AnswersKeysAndClicksOffScreen) {
  useWindow(Window::Screen::Offscreen);
}

TEST(Window, AnswersKeysAndClicksOnAnXServer) {
  const testing::XServer server;
  if (!server.running()) GTEST_SKIP() << "no Xvfb (package xvfb)";
  ::setenv("DISPLAY", server.display().c_str(), 1);
  useWindow(Window::Screen::Display);
  ::unsetenv("DISPLAY");
}

/// The room without its table.
SceneContent emptierRoom() {
  SceneContent content = testing::room();
  content.cuboids.erase(content.cuboids.begin() + tableTop(content));
  return content;
}

TEST(Window, OtherContentIsSeenFromTheSamePlace) {
  const std::unique_ptr<Window> opened =
      openWindow(testing::room(), small(), Window::Screen::Offscreen);
  Window& window = *opened;
  window.sendKey("Escape");
  window.sendKey("plus");
  const Image before = window.image();
  const CameraView view = window.camera();
  window.setContent(emptierRoom());
  EXPECT_EQ(view.position, window.camera().position);
  EXPECT_EQ(view.parallel, window.camera().parallel);
  EXPECT_GT(compareImages(window.image(), before).changed, 0.002);
  window.setContent(testing::room());
  EXPECT_LT(compareImages(window.image(), before).changed, 0.002);
  SceneContent broken = testing::room();
  broken.cuboids[0].center.x() = NAN;
  EXPECT_THROW(window.setContent(broken), InputError);
  EXPECT_LT(compareImages(window.image(), before).changed, 0.002) << "shown as it was";
}

TEST(Window, KeepsContentThatGrowsInViewUntilTheCameraIsMoved) {
  const std::unique_ptr<Window> opened =
      openWindow(testing::room(), small(), Window::Screen::Offscreen);
  Window& window = *opened;
  SceneContent larger = testing::room();
  for (Cuboid cuboid : testing::room().cuboids) {
    cuboid.center.x() += 8.0;
    larger.cuboids.push_back(cuboid);
  }
  window.setContent(larger);
  const CameraView framed = placeCamera(larger, small());
  EXPECT_LT((window.camera().position - framed.position).norm(), 1e-6);
  window.sendKey("plus");
  const CameraView moved = window.camera();
  window.setContent(testing::room());
  EXPECT_EQ(window.camera().position, moved.position);
}

TEST(Window, FollowsContentThatChanges) {
  const std::unique_ptr<Window> opened =
      openWindow(testing::room(), small(), Window::Screen::Offscreen);
  Window& window = *opened;
  const Image before = window.image();
  int asked = 0;
  window.follow(
      [&]() -> std::optional<SceneContent> {
        ++asked;
        if (asked == 1) return emptierRoom();
        if (asked == 2) throw InputError("half a file");
        return std::nullopt;
      },
      10.0);
  window.sendTimer();
  EXPECT_EQ(1, asked);
  EXPECT_GT(compareImages(window.image(), before).changed, 0.002);
  window.sendTimer();
  EXPECT_EQ("half a file", window.overlayText()) << "shown, not thrown through VTK";
  const Image shown = window.image();
  window.sendTimer();
  EXPECT_EQ(3, asked);
  EXPECT_EQ(0.0, compareImages(window.image(), shown).changed);
}

TEST(Window, ShowsWhatTheSnapshotShows) {
  ViewOptions options = small();
  options.show = Layers::fromString("occupied,edges,ground-grid,trajectory");
  const std::unique_ptr<Window> opened =
      openWindow(testing::room(), options, Window::Screen::Offscreen);
  Window& window = *opened;
  window.press("Escape");
  EXPECT_LT(compareImages(window.image(), renderSnapshot(testing::room(), options)).changed, 0.005);
}

TEST(Window, RefusesToOpenWithoutADisplay) {
  for (const char* display : {"", ":77"}) {
    ::setenv("DISPLAY", display, 1);
    try {
      openWindow(testing::room(), small());
      FAIL() << "opened a window on '" << display << "'";
    } catch (const RenderError& error) {
      EXPECT_NE(std::string(error.what()).find("--snapshot"), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("DISPLAY"), std::string::npos) << error.what();
    }
  }
  ::unsetenv("DISPLAY");
}

TEST(Window, RefusesAnXServerWithoutOpenGl) {
  const testing::XServer server({"-extension", "GLX"});
  if (!server.running()) GTEST_SKIP() << "no Xvfb (package xvfb)";
  ::setenv("DISPLAY", server.display().c_str(), 1);
  EXPECT_THROW(openWindow(testing::room(), small()), RenderError);
  ::unsetenv("DISPLAY");
}

TEST(Window, WritesScreenshotsUnderFreshNames) {
  const fs::path folder = fs::temp_directory_path() / ("window_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const std::unique_ptr<Window> opened =
      openWindow(testing::room(), small(), Window::Screen::Offscreen);
  Window& window = *opened;
  window.setScreenshotPrefix((folder / "shot").string());
  window.sendKey("s");
  EXPECT_EQ(window.overlayText(), "written: " + (folder / "shot_001.png").string());
  window.sendKey("s");
  const Image shot = readPng((folder / "shot_002.png").string());
  EXPECT_EQ(shot.width, 400);
  EXPECT_FALSE(isBlank(shot));
  window.setScreenshotPrefix((folder / "missing" / "shot").string());
  window.sendKey("s");
  EXPECT_NE(window.overlayText().find("cannot be created"), std::string::npos)
      << "an error is shown, not thrown through VTK";
  fs::remove_all(folder);
}

TEST(Window, ShowsAnErrorInsteadOfThrowingFromAKey) {
  SceneContent content = testing::room();
  content.trajectory.clear();
  const std::unique_ptr<Window> opened = openWindow(content, small(), Window::Screen::Offscreen);
  Window& window = *opened;
  window.sendKey("7");
  EXPECT_NE(window.overlayText().find("no trajectory"), std::string::npos);
}

TEST(Window, ListsEveryKeyInTheHelp) {
  const std::string help = Window::keyHelp();
  for (const char* word : {"screenshot", "first-person", "cutaway", "colour", "quit", "help"})
    EXPECT_NE(help.find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace planar_mapping
