// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/depth_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <string>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/image_file.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace io {
namespace {

DepthImage ramp(std::uint32_t width, std::uint32_t height) {
  DepthImage image;
  image.width = width;
  image.height = height;
  for (std::uint32_t i = 0; i < width * height; ++i)
    image.values.push_back(static_cast<std::uint16_t>(i * 257 % 65536));
  return image;
}

std::string contents(const std::string& path) {
  const auto bytes = readWholeFile(path);
  return {bytes.begin(), bytes.end()};
}

TEST(DepthImage, WritesWhatItReads) {
  const TemporaryDirectory dir;
  const DepthImage image = ramp(31, 17);
  writeDepthPng(dir / "d.png", image);
  const DepthImage back = readDepthPng(dir / "d.png");
  EXPECT_EQ(back.width, 31u);
  EXPECT_EQ(back.height, 17u);
  EXPECT_EQ(back.values, image.values);
  EXPECT_THROW(writeDepthPng(dir / "d.png", image), IoError);
}

TEST(DepthImage, RefusesWhatIsNoDepth) {
  const TemporaryDirectory dir;
  writeImage(dir / "c.png", {1, 1, 3, {0, 0, 0}});
  writeFileAtomically(dir / "text.png", "no image");
  writeFileAtomically(dir / "empty.png", "");
  for (const char* name : {"c.png", "text.png", "empty.png", "missing.png", "."}) {
    try {
      readDepthPng(dir / name);
      ADD_FAILURE() << name;
    } catch (const IoError& error) {
      EXPECT_EQ(error.path(), dir / name);
    }
  }
  EXPECT_THROW(writeDepthPng(dir / "d.png", DepthImage()), InputError);
  DepthImage lying = ramp(2, 2);
  lying.width = 3;
  EXPECT_THROW(writeDepthPng(dir / "d.png", lying), InputError);
}

TEST(DepthImage, SurvivesTruncationAndDamage) {
  const TemporaryDirectory dir;
  writeDepthPng(dir / "d.png", ramp(9, 7));
  const std::string sound = contents(dir / "d.png");
  for (std::size_t size = 0; size + 12 < sound.size(); ++size) {
    std::ofstream(dir / "cut.png", std::ios::binary) << sound.substr(0, size);
    EXPECT_THROW(readDepthPng(dir / "cut.png"), IoError) << size;
  }
  for (std::size_t bit = 0; bit < 8 * sound.size(); bit += 3) {
    std::string damaged = sound;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    std::ofstream(dir / "bit.png", std::ios::binary) << damaged;
    try {
      EXPECT_EQ(readDepthPng(dir / "bit.png").values.size(), 63u) << bit;
    } catch (const IoError&) {
    }
  }
}

TEST(DepthProjector, FollowsThePinholeModel) {
  PinholeCamera camera;
  camera.fx = 2.0;
  camera.fy = 4.0;
  camera.cx = 1.0;
  camera.cy = 0.5;
  camera.width = 3;
  camera.height = 2;
  DepthImage image;
  image.width = 3;
  image.height = 2;
  image.values = {1000, 2000, 3000, 65535, 65534, 4000};
  CloudData cloud;
  cloud.colors = {1};
  DepthProjector(camera, 1000.0).project(image, cloud);
  EXPECT_EQ(cloud.width, 3u);
  EXPECT_EQ(cloud.height, 2u);
  EXPECT_TRUE(cloud.colors.empty());
  const auto expect_point = [&](std::size_t i, double x, double y, double z) {
    EXPECT_NEAR(cloud.xyz[3 * i], x, 1e-5);
    EXPECT_NEAR(cloud.xyz[3 * i + 1], y, 1e-5);
    EXPECT_NEAR(cloud.xyz[3 * i + 2], z, 1e-5);
  };
  expect_point(0, -0.5, -0.125, 1.0);
  expect_point(1, 0.0, -0.25, 2.0);
  expect_point(2, 1.5, -0.375, 3.0);
  for (std::size_t c = 9; c < 12; ++c) EXPECT_TRUE(std::isnan(cloud.xyz[c]));
  expect_point(4, 0.0, 65.534 / 8, 65.534);
  expect_point(5, 2.0, 0.5, 4.0);
}

TEST(DepthProjector, DistancesAlongRaysEndOnASphere) {
  const PinholeCamera camera{50.0, 40.0, 30.0, 20.5, 64, 48};
  const std::vector<float> values(64 * 48, 2.5f);
  CloudData cloud;
  DepthProjector(camera, 1.0, true).project(values.data(), cloud);
  for (const int i : {0, 63, 1000, 64 * 48 - 1}) {
    const Eigen::Map<const Eigen::Vector3f> p(&cloud.xyz[3 * static_cast<std::size_t>(i)]);
    const Vector3 ray = camera.rayOf(i % 64, i / 64);
    EXPECT_NEAR(p.norm(), 2.5f, 1e-5) << i;
    EXPECT_NEAR(p.cast<double>().cross(ray).norm(), 0.0, 1e-5) << i;
  }
}

TEST(DepthProjector, FloatsAreProjectedLikeCounts) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  PinholeCamera camera{500.0, 400.0, 1.0, 0.5, 3, 2};
  const DepthImage image{3, 2, {1000, 0, 3000, 0, 65535, 0}};
  const std::vector<float> floats = {1000.0f, 0.0f, 3000.0f, kNaN, kInfinity, -5.0f};
  CloudData from_counts, from_floats;
  const DepthProjector projector(camera, 1000.0);
  projector.project(image, from_counts);
  projector.project(floats.data(), from_floats);
  EXPECT_EQ(3u, from_floats.width);
  EXPECT_EQ(2u, from_floats.height);
  ASSERT_EQ(from_counts.xyz.size(), from_floats.xyz.size());
  for (std::size_t i = 0; i < from_counts.xyz.size(); ++i) {
    EXPECT_TRUE(from_counts.xyz[i] == from_floats.xyz[i] ||
                (std::isnan(from_counts.xyz[i]) && std::isnan(from_floats.xyz[i])))
        << i;
  }
  EXPECT_FLOAT_EQ(1.0f, from_floats.xyz[2]);
}

TEST(DepthProjector, RefusesOtherSizesAndBadCameras) {
  PinholeCamera camera;
  CloudData cloud;
  EXPECT_THROW(DepthProjector(camera, 1000.0), ParameterError);
  camera.width = camera.height = 2;
  EXPECT_THROW(DepthProjector(camera, 1000.0), ParameterError);
  camera.fx = camera.fy = 1.0;
  EXPECT_THROW(DepthProjector(camera, 0.0), ParameterError);
  EXPECT_THROW(DepthProjector(camera, std::nan("")), ParameterError);
  EXPECT_THROW(DepthProjector(camera, 1000.0).project(ramp(3, 2), cloud), InputError);
}

}  // namespace
}  // namespace io
}  // namespace planar_mapping
