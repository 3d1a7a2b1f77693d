// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/simulation/stereo_sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/base/error.h"

namespace planar_mapping::evaluation {
namespace {

/// A wall across the view at \p depth, well textured, seen straight on.
Rendering wall(float depth, int width = 320, int height = 200) {
  Rendering view;
  view.camera = {250.0, 250.0, 0.5 * (width - 1), 0.5 * (height - 1), width, height};
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  view.depth.assign(pixels, depth);
  view.object.assign(pixels, 0);
  view.face.assign(pixels, 0);
  view.incidence.assign(pixels, 1.0f);
  view.texture.assign(pixels, 1.0f);
  view.colors.assign(pixels, 0);
  return view;
}

TEST(StereoSensor, WithoutErrorsGivesTheExactDepth) {
  const Rendering view = wall(3.0f);
  Random random(1);
  const std::vector<float> disparity =
      measureDisparity(view, StereoSensorParams::perfect(), random);
  const std::vector<float> xyz = pointsOf(disparity, view.camera, 0.12);
  for (std::size_t i = 0; i < view.size(); ++i) {
    EXPECT_NEAR(disparity[i], 0.12 * 250.0 / 3.0, 1e-5);
    EXPECT_NEAR(xyz[3 * i + 2], 3.0, 1e-5);
  }
  EXPECT_NEAR(xyz[0], -159.5 / 250.0 * 3.0, 1e-5);
  EXPECT_NEAR(xyz[1], -99.5 / 250.0 * 3.0, 1e-5);
}

TEST(StereoSensor, NoiseHasTheSpreadAndTheLikenessOfNeighboursAskedFor) {
  const Rendering view = wall(3.0f, 640, 480);
  StereoSensorParams params;
  params.noise_px = 0.4;
  params.disparity_step_px = 0.0;
  Random random(2);
  const std::vector<float> disparity = measureDisparity(view, params, random);
  double sum = 0.0, squares = 0.0, products = 0.0;
  std::size_t count = 0, pairs = 0;
  for (std::size_t i = 0; i + 1 < disparity.size(); ++i) {
    if (disparity[i] <= 0.0f) continue;
    const double error = disparity[i] - 10.0;
    sum += error;
    squares += error * error;
    ++count;
    if (disparity[i + 1] <= 0.0f || (i + 1) % 640 == 0) continue;
    products += error * (disparity[i + 1] - 10.0);
    ++pairs;
  }
  const double n = static_cast<double>(count);
  EXPECT_NEAR(sum / n, 0.0, 0.02);
  EXPECT_NEAR(std::sqrt(squares / n), 0.4, 0.02);
  // Neighbours share 70 % of the variance, less a little for being one of eight pixels apart.
  EXPECT_NEAR(products / static_cast<double>(pairs) / (squares / n), 0.69, 0.05);
}

TEST(StereoSensor, ResultsComeInSteps) {
  StereoSensorParams params;
  params.disparity_step_px = 0.25;
  Random random(3);
  for (const float d : measureDisparity(wall(2.3f), params, random))
    EXPECT_EQ(4.0f * d, std::round(4.0f * d));
}

TEST(StereoSensor, WhatTheSecondCameraDoesNotSeeIsMissing) {
  Rendering view = wall(6.0f);
  // A near square in front of the wall: disparity 30 px against 5 px.
  for (std::size_t row = 50; row < 150; ++row)
    for (std::size_t column = 150; column < 200; ++column) view.depth[row * 320 + column] = 1.0f;
  StereoSensorParams params;
  params.flying_fraction = params.edge_hole_fraction = 0.0;
  Random random(4);
  const std::vector<float> disparity = measureDisparity(view, params, random);
  const auto at = [&](std::size_t row, std::size_t column) {
    return disparity[row * 320 + column];
  };
  // The square covers columns 120 to 169 of the right image, the wall there is that of 125 to 174.
  EXPECT_EQ(at(100, 130), 0.0f);
  EXPECT_EQ(at(100, 145), 0.0f);
  EXPECT_GT(at(100, 120), 0.0f);
  EXPECT_GT(at(100, 170), 20.0f);
  EXPECT_GT(at(100, 205), 0.0f);
  EXPECT_EQ(at(10, 2), 0.0f) << "left of the right image";
}

TEST(StereoSensor, MatchableIsWhatBothCamerasSee) {
  Rendering view = wall(6.0f);
  for (std::size_t row = 50; row < 150; ++row)
    for (std::size_t column = 150; column < 200; ++column) view.depth[row * 320 + column] = 1.0f;
  view.texture.assign(view.texture.size(), 0.0f);
  view.incidence[10 * 320 + 300] = 0.01f;
  const Rendering part = matchablePart(view, StereoSensorParams());
  const auto isThere = [&](std::size_t row, std::size_t column) {
    return part.object[row * 320 + column] >= 0;
  };
  EXPECT_FALSE(isThere(100, 130)) << "hidden by the square";
  EXPECT_FALSE(isThere(10, 2)) << "left of the right image";
  EXPECT_FALSE(isThere(10, 300)) << "grazed";
  EXPECT_TRUE(isThere(10, 301)) << "a surface without texture is there to be found";
  EXPECT_TRUE(isThere(100, 120));
  EXPECT_TRUE(isThere(100, 170));
  EXPECT_EQ(part.depth, view.depth);
}

TEST(StereoSensor, EdgesHaveHolesAndFlyingPixels) {
  Rendering view = wall(6.0f);
  for (std::size_t row = 0; row < 200; ++row)
    for (std::size_t column = 0; column < 160; ++column) view.depth[row * 320 + column] = 2.0f;
  StereoSensorParams params;
  params.noise_px = 0.0;
  params.disparity_step_px = 0.0;
  Random random(5);
  const std::vector<float> disparity = measureDisparity(view, params, random);
  int flying = 0, holes = 0, edge = 0;
  for (std::size_t row = 0; row < 200; ++row) {
    for (const std::size_t column : {159u, 160u}) {
      const float d = disparity[row * 320 + column];
      ++edge;
      holes += d == 0.0f ? 1 : 0;
      flying += d > 5.001f && d < 14.999f ? 1 : 0;
    }
  }
  EXPECT_NEAR(holes, 0.25 * edge, 0.08 * edge);
  EXPECT_NEAR(flying, 0.25 * edge, 0.08 * edge);
}

TEST(StereoSensor, WrongMatchesHaveTheShareAskedFor) {
  const Rendering view = wall(3.0f);
  for (const double fraction : {0.0, 0.05, 0.2}) {
    StereoSensorParams params;
    params.wrong_fraction = fraction;
    Random random(8);
    const std::vector<float> disparity = measureDisparity(view, params, random);
    int wrong = 0, measured = 0;
    for (const float d : disparity) {
      measured += d > 0.0f ? 1 : 0;
      wrong += d > 0.0f && std::abs(d - 10.0f) > 2.0f ? 1 : 0;
      EXPECT_LT(d, 13.0f);
    }
    // Disparities go from 3 to about 11 px; a third of the wrong ones lies within 2 px by chance.
    EXPECT_NEAR(wrong, fraction * 0.63 * measured, 0.012 * measured) << fraction;
  }
  // The right ones stay what they were.
  StereoSensorParams params;
  Random clean_random(8);
  const std::vector<float> clean = measureDisparity(view, params, clean_random);
  params.wrong_fraction = 0.1;
  Random random(8);
  const std::vector<float> disparity = measureDisparity(view, params, random);
  std::size_t same = 0;
  for (std::size_t i = 0; i < clean.size(); ++i) same += clean[i] == disparity[i] ? 1 : 0;
  EXPECT_NEAR(static_cast<double>(same), 0.9 * static_cast<double>(clean.size()),
              0.02 * static_cast<double>(clean.size()));
}

TEST(StereoSensor, RefusesParametersOutOfRange) {
  const auto refused = [](void (*change)(StereoSensorParams&)) {
    StereoSensorParams params;
    change(params);
    EXPECT_THROW(params.validate(), ParameterError);
  };
  refused([](StereoSensorParams& p) { p.baseline = 0.0; });
  refused([](StereoSensorParams& p) { p.noise_px = -1.0; });
  refused([](StereoSensorParams& p) { p.noise_px = std::numeric_limits<double>::quiet_NaN(); });
  refused([](StereoSensorParams& p) { p.correlation_px = 0.5; });
  refused([](StereoSensorParams& p) { p.flying_fraction = 0.9; });
  refused([](StereoSensorParams& p) { p.edge_px = 0.0; });
  refused([](StereoSensorParams& p) { p.wrong_fraction = 1.1; });
  refused([](StereoSensorParams& p) { p.wrong_patch_px = 0; });
  EXPECT_NO_THROW(StereoSensorParams().validate());
  EXPECT_NO_THROW(StereoSensorParams::perfect().validate());
}

}  // namespace
}  // namespace planar_mapping::evaluation
