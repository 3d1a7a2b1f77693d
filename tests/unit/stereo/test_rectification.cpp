// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/rectification.h"

#include <gtest/gtest.h>

#include <cmath>

#include "planar_mapping/base/error.h"
#include "stereo_images.h"

namespace planar_mapping {
namespace {

constexpr int kRectifiedWidth = 320;
constexpr int kRectifiedHeight = 240;

io::Calibration unrectified() {
  io::Calibration calibration = pairCalibration(kRectifiedWidth, kRectifiedHeight);
  calibration.baseline.reset();
  io::UnrectifiedPair pair;
  pair.left = {-0.2, 0.05, 0.001, -0.002, 0.0};
  pair.right = {-0.18, 0.04, -0.001, 0.001, 0.01};
  pair.right_camera = calibration.camera;
  pair.right_camera.fx = 305.0;
  pair.right_camera.fy = 304.0;
  pair.right_camera.cx += 4.0;
  pair.right_camera.cy -= 6.0;
  pair.T_right_left.linear() =
      Eigen::AngleAxisd(0.03, Vector3(0.4, 0.8, -0.5).normalized()).toRotationMatrix();
  pair.T_right_left.translation() = Vector3(-0.1, 0.003, 0.004);
  calibration.unrectified = pair;
  return calibration;
}

/// Brown's model, written down again.
Vector2 project(const PinholeCamera& camera, const io::LensDistortion& lens, const Vector3& point) {
  const double x = point.x() / point.z();
  const double y = point.y() / point.z();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  const double xd = x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x);
  const double yd = y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y;
  return {camera.fx * xd + camera.cx, camera.fy * yd + camera.cy};
}

io::Image spotAt(const Vector2& place) {
  return paint(kRectifiedWidth, kRectifiedHeight, [&](int column, int row) {
    const double r2 = (Vector2(column, row) - place).squaredNorm();
    return 220.0 * std::exp(-r2 / 8.0);
  });
}

Vector2 centroid(const io::Image& image) {
  Vector2 sum = Vector2::Zero();
  double weight = 0.0;
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const double value = image.pixels[static_cast<std::size_t>(row * image.width + column)];
      sum += value * Vector2(column, row);
      weight += value;
    }
  }
  return sum / weight;
}

TEST(Rectification, PointsGetTheSameRowAndTheirDepth) {
  const io::Calibration calibration = unrectified();
  const Rectifier rectifier(calibration);
  const io::Calibration& rectified = rectifier.calibration();
  EXPECT_FALSE(rectified.unrectified);
  ASSERT_TRUE(rectified.baseline);
  EXPECT_NEAR(*rectified.baseline, calibration.unrectified->T_right_left.translation().norm(),
              1e-9);
  for (const Vector3& point : {Vector3(0.0, 0.0, 1.0), Vector3(0.3, -0.2, 1.2),
                               Vector3(-0.25, 0.2, 0.9), Vector3(0.5, 0.4, 3.0)}) {
    const Vector2 left = project(calibration.camera, calibration.unrectified->left, point);
    const Vector2 right =
        project(calibration.unrectified->right_camera, calibration.unrectified->right,
                calibration.unrectified->T_right_left * point);
    const Vector2 l = centroid(rectifier.rectifyLeft(spotAt(left)));
    const Vector2 r = centroid(rectifier.rectifyRight(spotAt(right)));
    EXPECT_NEAR(l.y(), r.y(), 0.1);
    const Vector3 turned = rectifier.rotation() * point;
    const double disparity = l.x() - r.x() + rectified.cx_right - rectified.camera.cx;
    EXPECT_NEAR(rectified.camera.fx * *rectified.baseline / disparity, turned.z(),
                0.01 * turned.z());
    EXPECT_NEAR((l.x() - rectified.camera.cx) / rectified.camera.fx, turned.x() / turned.z(), 1e-3);
    EXPECT_NEAR((l.y() - rectified.camera.cy) / rectified.camera.fy, turned.y() / turned.z(), 1e-3);
  }
}

TEST(Rectification, NoBorderStaysBlack) {
  const Rectifier rectifier(unrectified());
  const io::Image white = uniform(kRectifiedWidth, kRectifiedHeight, 200.0);
  for (const io::Image& image : {rectifier.rectifyLeft(white), rectifier.rectifyRight(white)}) {
    for (const std::uint8_t value : image.pixels) ASSERT_GE(value, 150);
  }
}

TEST(Rectification, ColorsAreKept) {
  io::Image color;
  color.width = kRectifiedWidth;
  color.height = kRectifiedHeight;
  color.channels = 3;
  for (int i = 0; i < kRectifiedWidth * kRectifiedHeight; ++i)
    color.pixels.insert(color.pixels.end(), {10, 100, 200});
  const io::Image out = Rectifier(unrectified()).rectifyLeft(color);
  ASSERT_EQ(out.channels, 3);
  const std::size_t center =
      3 * static_cast<std::size_t>(kRectifiedHeight / 2 * kRectifiedWidth + kRectifiedWidth / 2);
  EXPECT_EQ(out.pixels[center], 10);
  EXPECT_EQ(out.pixels[center + 1], 100);
  EXPECT_EQ(out.pixels[center + 2], 200);
}

/// A wall of a pattern at 12 pixels of disparity; what the right image shows is `down` rows lower,
/// and turned about its middle.
std::optional<double> rowsOfPair(double down, double turn) {
  const Pattern pattern(7);
  io::Image left = uniform(kRectifiedWidth, kRectifiedHeight, 0.0), right = left;
  for (int y = 0; y < kRectifiedHeight; ++y) {
    for (int x = 0; x < kRectifiedWidth; ++x) {
      const auto i = static_cast<std::size_t>(y * kRectifiedWidth + x);
      const double dx = x - 0.5 * kRectifiedWidth, dy = y - 0.5 * kRectifiedHeight;
      left.pixels[i] = static_cast<std::uint8_t>(pattern(x, y));
      right.pixels[i] =
          static_cast<std::uint8_t>(pattern(x + 12.0 - turn * dy, y - down + turn * dx));
    }
  }
  return rowsApart(left, right, pairCalibration(kRectifiedWidth, kRectifiedHeight));
}

TEST(Rectification, TellsHowManyRowsAPairIsApart) {
  const std::optional<double> none = rowsOfPair(0.0, 0.0), three = rowsOfPair(3.0, 0.0);
  ASSERT_TRUE(none && three);
  EXPECT_LT(*none, 0.5);
  EXPECT_NEAR(*three, 3.0, 0.5);
  // By 2 degrees: up to 5.6 rows on either side, none in the middle.
  const std::optional<double> turned = rowsOfPair(0.0, 0.035);
  ASSERT_TRUE(turned);
  EXPECT_GT(*turned, 1.0);
  EXPECT_LT(*turned, 5.6);
  const io::Image plain = uniform(kRectifiedWidth, kRectifiedHeight, 128.0);
  EXPECT_FALSE(rowsApart(plain, plain, pairCalibration(kRectifiedWidth, kRectifiedHeight)));
  EXPECT_THROW(rowsApart(plain, io::Image(), pairCalibration(kRectifiedWidth, kRectifiedHeight)),
               InputError);
}

TEST(Rectification, SaysWhatIsWrongWithAPair) {
  EXPECT_THROW(Rectifier(pairCalibration(kRectifiedWidth, kRectifiedHeight)), InputError);
  io::Calibration calibration = unrectified();
  calibration.unrectified->T_right_left.translation().x() = 0.1;
  try {
    const Rectifier rectifier(calibration);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("exchanged"), std::string::npos);
  }
  calibration.unrectified->T_right_left.translation() = Vector3(0.0, -0.1, 0.0);
  EXPECT_THROW(Rectifier{calibration}, InputError);
  const Rectifier rectifier(unrectified());
  EXPECT_THROW(rectifier.rectifyLeft(uniform(8, 8, 1.0)), InputError);
  EXPECT_THROW(rectifier.rectifyRight(io::Image()), InputError);
}

}  // namespace
}  // namespace planar_mapping
