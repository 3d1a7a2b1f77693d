// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/disparity_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

io::Calibration smallCalibration() {
  io::Calibration calibration;
  calibration.camera.width = 4;
  calibration.camera.height = 2;
  calibration.camera.fx = 100.0;
  calibration.camera.fy = 50.0;
  calibration.camera.cx = 1.0;
  calibration.camera.cy = 0.5;
  calibration.cx_right = 3.0;  // infinity is at disparity -2
  calibration.baseline = 0.2;
  return calibration;
}

DisparityImage smallImage() {
  return {4, 2, {2.0f, 8.0f, kNaN, -2.0f, -3.0f, 0.0f, 18.0f, 1e30f}};
}

TEST(DisparityImage, PointsFollowFromTheEquation) {
  std::vector<float> xyz;
  triangulate(smallImage(), smallCalibration(), xyz);
  ASSERT_EQ(xyz.size(), 24u);
  // d = 2: Z = 100 * 0.2 / (2 + 2) = 5, X = (0 - 1) 5 / 100, Y = (0 - 0.5) 5 / 50.
  EXPECT_FLOAT_EQ(xyz[0], -0.05f);
  EXPECT_FLOAT_EQ(xyz[1], -0.05f);
  EXPECT_FLOAT_EQ(xyz[2], 5.0f);
  // d = 18 at (2, 1): Z = 1.
  EXPECT_FLOAT_EQ(xyz[18], 0.01f);
  EXPECT_FLOAT_EQ(xyz[19], 0.01f);
  EXPECT_FLOAT_EQ(xyz[20], 1.0f);
  // None, at infinity, behind the camera.
  for (const std::size_t i : {2u, 3u, 4u}) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_TRUE(std::isnan(xyz[3 * i + k])) << i;
  }
}

TEST(DisparityImage, DensityCountsWhatIsThere) {
  EXPECT_DOUBLE_EQ(smallImage().density(), 7.0 / 8.0);
  EXPECT_DOUBLE_EQ(DisparityImage().density(), 0.0);
}

TEST(DisparityImage, RefusesCalibrationsThatDoNotFit) {
  std::vector<float> xyz;
  io::Calibration calibration = smallCalibration();
  calibration.baseline.reset();
  EXPECT_THROW(triangulate(smallImage(), calibration, xyz), InputError);
  calibration = smallCalibration();
  calibration.camera.width = 5;
  EXPECT_THROW(triangulate(smallImage(), calibration, xyz), InputError);
  calibration = smallCalibration();
  calibration.unrectified.emplace();
  EXPECT_THROW(triangulate(smallImage(), calibration, xyz), InputError);
  DisparityImage damaged = smallImage();
  damaged.values.pop_back();
  EXPECT_THROW(triangulate(damaged, smallCalibration(), xyz), InputError);
}

}  // namespace
}  // namespace planar_mapping
