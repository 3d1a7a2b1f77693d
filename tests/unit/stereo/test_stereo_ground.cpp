// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Ground of real sequences and what stands on it.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "planar_mapping/io/depth_image.h"
#include "stereo_clouds.h"

namespace planar_mapping {
namespace {

using test::above;
using test::Cloud;
using test::groundOf;
using test::isMissing;
using test::kDegree;
using test::kSettings;
using test::limited;
using test::matched;
using test::planesOf;
using test::realData;
using test::Setting;

std::string number(int frame) {
  const std::string digits = std::to_string(frame);
  return std::string(6 - digits.size(), '0') + digits;
}

/// Points of upright planes from 0.15 m to 0.5 m over the ground, and those removed with it.
struct Feet {
  std::size_t points = 0;
  std::size_t removed = 0;
};

void addFoot(const Cloud& cloud, const Ground& ground, const PlaneSegment& wall, Feet& feet) {
  if (std::fabs(wall.plane.normal.dot(ground.plane.normal)) > 0.2) return;
  Vector3 low = Vector3::Constant(1e9);
  Vector3 high = -low;
  for (const int i : wall.inliers) {
    const Vector3 p = cloud.view().point(static_cast<std::size_t>(i));
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  for (std::size_t i = 0; i < cloud.valid.size(); ++i) {
    const Vector3 p = cloud.view().point(static_cast<std::size_t>(cloud.valid[i]));
    const double height = ground.plane.signedDistance(p);
    if (p.z() > 15.0 || height < 0.15 || height > 0.5) continue;
    if (p.x() < low.x() || p.x() > high.x() || p.z() < low.z() || p.z() > high.z()) continue;
    if (std::fabs(wall.plane.signedDistance(p)) > 0.1) continue;
    ++feet.points;
    feet.removed += ground.is_ground[i] != 0 ? 1 : 0;
  }
}

TEST(StereoGround, StreetHasGroundInEveryFrameAndNothingStandsOnIt) {
  const std::string set = "stereo_kitti_street";
  if (isMissing(set)) GTEST_SKIP() << "no " << set;
  Feet feet;
  for (int frame = 0; frame < 28; frame += 3) {
    const Cloud cloud = matched(set, number(frame));
    const Ground ground = groundOf(cloud);
    ASSERT_TRUE(ground.found) << frame;
    EXPECT_NEAR(ground.height, 1.65, 0.1) << frame;
    std::size_t on_road = 0;
    for (const int i : above(cloud, ground)) {
      const Vector3 p = cloud.view().point(static_cast<std::size_t>(i));
      const bool driven = std::fabs(p.x()) < 1.0 && p.z() > 4.0 && p.z() < 15.0;
      if (driven && ground.plane.signedDistance(p) < 2.0) ++on_road;
    }
    EXPECT_LT(on_road, 50U) << frame;  // of some 20,000 in the driven corridor
    const Indices left = above(cloud, ground);
    for (const PlaneSegment& plane : planesOf(cloud, &left).planes) {
      addFoot(cloud, ground, plane, feet);
    }
  }
  // Walls, hedges and cars keep their feet; which hedges are planes depends on single pixels, and
  // with them the fraction: 5 to 8 % of 99 in 100 pixels.
  EXPECT_GT(feet.points, 5000U);
  EXPECT_LT(feet.removed, feet.points / 10);
}

TEST(StereoGround, WhatTheStreetLeavesIsSearchedInDisparitySpace) {
  const std::string set = "stereo_kitti_street";
  if (isMissing(set)) GTEST_SKIP() << "no " << set;
  const Setting& outdoor = kSettings[2];
  for (int frame = 12; frame < 28; frame += 3) {
    const Cloud cloud = limited(matched(set, number(frame)), outdoor);
    const Ground ground = groundOf(cloud);
    const Indices left = above(cloud, ground);
    EXPECT_LT(3 * left.size(), cloud.view().size) << frame;  // mostly less than a quarter
    const PlaneSet found = planesOf(cloud, &left, outdoor);
    EXPECT_EQ(found.diagnostics.method, PlaneSearchMethod::Disparity) << frame;
    for (const PlaneSegment& segment : found.planes) {
      // Lawns lie within 3 cm of their planes; in metres, planes through several of them within 11.
      const bool level = segment.plane.normal.dot(ground.plane.normal) > std::cos(15.0 * kDegree);
      if (level) {
        EXPECT_LT(segment.rms, 0.05) << frame;
      }
    }
  }
}

TEST(StereoGround, PlasterOfTheFacadeIsTooBrightToBeMatched) {
  const std::string set = "stereo_kitti_street";
  if (isMissing(set)) GTEST_SKIP() << "no " << set;
  // Between two windows: one gray value, so that no matching can tell its columns apart.
  const io::Image left = io::readImage(realData(set) + "/left/000012.png");
  const Cloud cloud = matched(set, "000012");
  int saturated = 0;
  int matched_pixels = 0;
  int all = 0;
  for (int row = 10; row < 170; ++row) {
    for (int column = 1105; column < 1140; ++column, ++all) {
      const auto i = static_cast<std::size_t>(row * cloud.width + column);
      saturated += left.pixels[i] == 255 ? 1 : 0;
      matched_pixels += cloud.view().isMeasured(i) ? 1 : 0;
    }
  }
  EXPECT_GT(saturated, 0.99 * all);
  EXPECT_LT(matched_pixels, 0.2 * all);
}

TEST(StereoGround, CabinetStandsOnAFloorInEveryFrame) {
  const std::string set = "rgbd_tum_cabinet";
  if (isMissing(set)) GTEST_SKIP() << "no " << set;
  const io::Calibration calibration = io::readCalibration(realData(set) + "/calib.yaml");
  std::vector<Vector3> up;  // of each frame, in the camera's frame: carried by hand, looking down
  std::ifstream file(realData(set) + "/poses.txt");
  std::string line;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    double stamp = 0.0, x = 0.0, y = 0.0, z = 0.0, qx = 0.0, qy = 0.0, qz = 0.0, qw = 0.0;
    words >> stamp >> x >> y >> z >> qx >> qy >> qz >> qw;
    up.push_back(Quaternion(qw, qx, qy, qz).normalized().conjugate() * Vector3::UnitZ());
  }
  ASSERT_EQ(up.size(), 58U);
  for (int frame = 0; frame < 58; frame += 6) {
    const io::DepthImage depth =
        io::readDepthPng(realData(set) + "/depth/" + number(frame) + ".png");
    Cloud cloud;
    cloud.width = static_cast<int>(depth.width);
    cloud.height = static_cast<int>(depth.height);
    const PinholeCamera& camera = calibration.camera;
    for (int row = 0; row < cloud.height; ++row) {
      for (int column = 0; column < cloud.width; ++column) {
        const auto value = depth.values[static_cast<std::size_t>(row * cloud.width + column)];
        const float z = value > 0 ? static_cast<float>(value / *calibration.depth_scale)
                                  : std::numeric_limits<float>::quiet_NaN();
        cloud.xyz.push_back(z * static_cast<float>((column - camera.cx) / camera.fx));
        cloud.xyz.push_back(z * static_cast<float>((row - camera.cy) / camera.fy));
        cloud.xyz.push_back(z);
      }
    }
    cloud.list();
    GroundParams params;
    params.camera_height = 0.0;
    params.up = up[static_cast<std::size_t>(frame)];
    const Ground ground = findGround(cloud.view(), &cloud.valid, params);
    EXPECT_TRUE(ground.found) << frame << " " << toString(ground.diagnostics.status);
  }
}

}  // namespace
}  // namespace planar_mapping
