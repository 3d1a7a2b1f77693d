// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/image_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "planar_mapping/base/error.h"

namespace planar_mapping::evaluation {
namespace {

constexpr double kSkyGray = 0.299 * 0xBF + 0.587 * 0xD2 + 0.114 * 0xE6;

PinholeCamera cameraOf(int width, int height, double focal_length) {
  return {focal_length, focal_length, 0.5 * (width - 1), 0.5 * (height - 1), width, height};
}

ImageSensorParams noiseless(bool color = false) {
  ImageSensorParams sensor;
  sensor.noise = 0.0;
  sensor.color = color;
  return sensor;
}

io::Image imageOf(const Scene& scene, const PinholeCamera& camera, const Pose& pose,
                  const RenderParams& params = RenderParams(),
                  const ImageSensorParams& sensor = noiseless()) {
  return renderImage(scene, render(scene, camera, pose, params), pose, params, sensor);
}

/// A wall across the optical axis at \p depth, wide enough for any view.
Scene wallAt(double depth, const Material& material) {
  Scene scene;
  SceneObject wall;
  wall.size = Vector3(4000, 4000, 1);
  wall.T_world_object.translation() = Vector3(0.3, 0.2, depth + 0.5);
  wall.material = material;
  scene.objects.push_back(wall);
  return scene;
}

double spreadOf(const io::Image& image) {
  double sum = 0.0, squares = 0.0;
  for (const std::uint8_t pixel : image.pixels) {
    sum += pixel;
    squares += static_cast<double>(pixel) * pixel;
  }
  const double n = static_cast<double>(image.pixels.size());
  return std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)));
}

TEST(RenderImage, ALeftPixelAppearsAtItsDisparityInTheRightImage) {
  constexpr double kBaseline = 0.12;
  const PinholeCamera camera = cameraOf(320, 240, 250.0);
  for (const std::string& name : sceneNames()) {
    const Scene scene = makeScene(name, 3);
    const Pose left_pose = scene.path[1];
    Pose right_pose = left_pose;
    right_pose.translation() += kBaseline * left_pose.linear().col(0);
    const Rendering left_view = render(scene, camera, left_pose);
    const Rendering right_view = render(scene, camera, right_pose);
    const io::Image left = renderImage(scene, left_view, left_pose, {}, noiseless());
    const io::Image right = renderImage(scene, right_view, right_pose, {}, noiseless());
    std::vector<double> differences;
    for (int row = 0; row < camera.height; ++row)
      for (int column = 0; column < camera.width; ++column) {
        const std::size_t i = static_cast<std::size_t>(row * camera.width + column);
        if (left_view.object[i] < 0) continue;
        const double d = kBaseline * camera.fx / static_cast<double>(left_view.depth[i]);
        const double at = column - d;
        if (at < 0.0) continue;
        const auto whole = static_cast<std::size_t>(at);
        const double fraction = at - static_cast<double>(whole);
        const std::size_t k = static_cast<std::size_t>(row * camera.width) + whole;
        const auto seen = [&](std::size_t pixel) {
          return right_view.object[pixel] == left_view.object[i] &&
                 right_view.face[pixel] == left_view.face[i];
        };
        if (!seen(k) || !seen(k + 1)) continue;  // hidden from the right camera
        const double value = (1.0 - fraction) * right.pixels[k] + fraction * right.pixels[k + 1];
        differences.push_back(std::abs(value - left.pixels[i]));
      }
    ASSERT_GT(differences.size(), left.pixels.size() / 3) << name;
    std::sort(differences.begin(), differences.end());
    EXPECT_LT(differences[differences.size() / 2], 2.0) << name;
    EXPECT_LT(differences[differences.size() * 9 / 10], 8.0) << name;
  }
}

TEST(RenderImage, NoiseHasTheSpreadAskedForAndNoBias) {
  const Scene scene = wallAt(2.0, Material());
  const PinholeCamera camera = cameraOf(200, 100, 150.0);
  ImageSensorParams sensor;
  sensor.noise = 4.0;
  sensor.seed = 3;
  const io::Image clean = imageOf(scene, camera, Pose::Identity());
  const io::Image noisy = imageOf(scene, camera, Pose::Identity(), {}, sensor);
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < clean.pixels.size(); ++i) {
    const double difference = static_cast<double>(noisy.pixels[i]) - clean.pixels[i];
    sum += difference;
    squares += difference * difference;
  }
  const double n = static_cast<double>(clean.pixels.size());
  EXPECT_NEAR(sum / n, 0.0, 0.15);
  EXPECT_NEAR(std::sqrt(squares / n), 4.0, 0.2);
}

TEST(RenderImage, DetailsTooSmallForAPixelFade) {
  const PinholeCamera camera = cameraOf(160, 120, 120.0);
  for (const Pattern pattern : {Pattern::Speckles, Pattern::Planks, Pattern::Tiles}) {
    const Material material{0x909090, pattern, 1.0};
    EXPECT_GT(spreadOf(imageOf(wallAt(1.0, material), camera, Pose::Identity())), 5.0);
    // A pixel covers 5 metres here: whatever the pattern, it is gray.
    EXPECT_LT(spreadOf(imageOf(wallAt(600.0, material), camera, Pose::Identity())), 1.0);
  }
}

TEST(RenderImage, SurfacesWithoutTextureAreEven) {
  const Scene scene = wallAt(2.0, {0x909090, Pattern::Tiles, 1.0, 0.5});
  const PinholeCamera camera = cameraOf(160, 120, 120.0);
  RenderParams params;
  params.plain_fraction = 1.0;
  const Rendering view = render(scene, camera, Pose::Identity(), params);
  for (const float texture : view.texture) EXPECT_EQ(texture, 0.0f);
  params.plain_fraction = 0.4;
  const Rendering partly = render(scene, camera, Pose::Identity(), params);
  const auto plain = std::count(partly.texture.begin(), partly.texture.end(), 0.0f);
  EXPECT_NEAR(static_cast<double>(plain), 0.4 * static_cast<double>(partly.size()),
              0.3 * static_cast<double>(partly.size()));
}

TEST(RenderImage, PixelsAtABorderAreMixedByArea) {
  // The box covers the right part of the view from x = 0.05 on, at depth 2: column 31.5 + 40 x / z.
  Scene scene;
  SceneObject box;
  box.size = Vector3(10, 100, 1e-3);
  box.material = {0x202020, Pattern::Plain, 0.0};
  scene.objects.push_back(box);
  const PinholeCamera camera = cameraOf(64, 48, 40.0);
  for (const double covered : {0.125, 0.5, 0.8125}) {
    // The left border lies in column 40, whose pixel reaches from 39.5 to 40.5.
    const double border = 40.5 - covered;
    const double x = (border - camera.cx) / camera.fx * 2.0;
    scene.objects[0].T_world_object.translation() = Vector3(x + 5.0, 0, 2.0005);
    const io::Image image = imageOf(scene, camera, Pose::Identity());
    const std::size_t row = 24 * 64;
    const double sky = image.pixels[row + 30];
    const double dark = image.pixels[row + 50];
    EXPECT_NEAR(sky, kSkyGray, 1.0);
    EXPECT_LT(dark, 40.0);
    EXPECT_NEAR(image.pixels[row + 40], covered * dark + (1.0 - covered) * sky, 2.0);
    EXPECT_EQ(image.pixels[row + 38], image.pixels[row + 30]);
  }
}

TEST(RenderImage, GrayIsTheLuminanceOfColor) {
  const Scene scene = makeScene("outdoor", 1);
  const PinholeCamera camera = cameraOf(96, 72, 75.0);
  const io::Image gray = imageOf(scene, camera, scene.path[0]);
  const io::Image color = imageOf(scene, camera, scene.path[0], {}, noiseless(true));
  EXPECT_EQ(gray.channels, 1);
  ASSERT_EQ(color.channels, 3);
  ASSERT_EQ(color.pixels.size(), 3 * gray.pixels.size());
  for (std::size_t i = 0; i < gray.pixels.size(); ++i)
    EXPECT_NEAR(gray.pixels[i],
                0.299 * color.pixels[3 * i] + 0.587 * color.pixels[3 * i + 1] +
                    0.114 * color.pixels[3 * i + 2],
                1.0);
}

TEST(RenderImage, RefusesViewsWithoutColorsAndBadParameters) {
  const Scene scene = wallAt(2.0, Material());
  const PinholeCamera camera = cameraOf(16, 12, 10.0);
  RenderParams params;
  params.colors = false;
  const Rendering view = render(scene, camera, Pose::Identity(), params);
  EXPECT_THROW(renderImage(scene, view, Pose::Identity(), params, noiseless()), InputError);
  EXPECT_THROW(renderImage(scene, Rendering(), Pose::Identity(), {}, noiseless()), InputError);
  params.colors = true;
  params.plain_fraction = 1.5;
  EXPECT_THROW(render(scene, camera, Pose::Identity(), params), ParameterError);
  params = RenderParams();
  params.threads = -1;
  EXPECT_THROW(render(scene, camera, Pose::Identity(), params), ParameterError);
  ImageSensorParams sensor;
  sensor.noise = std::nan("");
  const Rendering sound = render(scene, camera, Pose::Identity());
  EXPECT_THROW(renderImage(scene, sound, Pose::Identity(), {}, sensor), ParameterError);
}

}  // namespace
}  // namespace planar_mapping::evaluation
