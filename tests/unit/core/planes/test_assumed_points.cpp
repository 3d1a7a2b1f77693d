// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/planes/detail/assumed_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

constexpr int kWidth = 80;
constexpr int kHeight = 60;
constexpr float kDepth = 2.0f;

/// An upright wall across the optical axis that is measured in bands of 8 pixels at some borders.
struct Wall {
  PinholeCamera camera{100.0, 100.0, 39.5, 29.5, kWidth, kHeight};
  std::vector<float> xyz = std::vector<float>(3 * kWidth * kHeight, NAN);
  std::vector<std::uint8_t> gray = std::vector<std::uint8_t>(kWidth * kHeight, 200);
  std::vector<PlaneSegment> planes;

  explicit Wall(bool right_is_another = false) {
    planes.resize(right_is_another ? 2 : 1);
    for (PlaneSegment& segment : planes) segment.plane = Plane{-Vector3::UnitZ(), kDepth};
    for (int i = 0; i < kWidth * kHeight; ++i) {
      gray[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(200 + i * 7 % 3);  // noise
      const int column = i % kWidth;
      if (column >= 8 && column < kWidth - 8) continue;
      const Vector3 point = kDepth * camera.rayOf(column, i / kWidth);
      for (int k = 0; k < 3; ++k)
        xyz[static_cast<std::size_t>(3 * i + k)] = static_cast<float>(point[k]);
      planes[right_is_another && column >= 8 ? 1 : 0].inliers.push_back(i);
    }
  }
  AssumedPoints assumed() const {
    return assumePoints(PointsView(xyz.data(), kWidth, kHeight, 3), camera,
                        evenTiles(gray.data(), kWidth, kHeight), planes);
  }
};

TEST(AssumedPoints, AWallOfOneColourBetweenItsEndsIsThePlane) {
  const AssumedPoints assumed = Wall().assumed();
  ASSERT_EQ(assumed.of_plane.size(), 1u);
  EXPECT_EQ(assumed.of_plane[0].size(), std::size_t{(kWidth - 16) * kHeight});
  for (std::size_t i = 0; i < assumed.xyz.size(); i += 3) EXPECT_EQ(assumed.xyz[i + 2], kDepth);
  EXPECT_LT(assumed.probability, 1.0);
}

TEST(AssumedPoints, BetweenTwoPlanesNothingIs) {
  EXPECT_TRUE(Wall(true).assumed().empty());
}

/// A picture or a base board has too few points to be found as part of the plane it lies on.
TEST(AssumedPoints, WhatLiesOnAPlaneIsAnEndOfIt) {
  Wall wall(true);
  wall.planes.resize(1);
  wall.planes[0].rms = 0.01;
  EXPECT_EQ(wall.assumed().of_plane[0].size(), std::size_t{(kWidth - 16) * kHeight});
  for (int i = 0; i < kWidth * kHeight; ++i) {
    if (i % kWidth >= kWidth - 8) wall.xyz[static_cast<std::size_t>(3 * i + 2)] -= 0.03f;
  }
  EXPECT_TRUE(wall.assumed().empty());
}

TEST(AssumedPoints, WhatHasAnEdgeAroundItIsAnotherThing) {
  Wall wall;
  for (int row = 16; row < 44; ++row) {
    for (int column = 24; column < 56; ++column) {
      wall.gray[static_cast<std::size_t>(row * kWidth + column)] = 150;
    }
  }
  const std::vector<float> xyz = wall.assumed().xyz;
  EXPECT_FALSE(xyz.empty());
  for (std::size_t i = 0; i < xyz.size(); i += 3) {
    const Vector2 pixel = wall.camera.project(Vector3(xyz[i], xyz[i + 1], xyz[i + 2]));
    const bool inside =
        pixel.x() > 24.0 && pixel.x() < 55.0 && pixel.y() > 16.0 && pixel.y() < 43.0;
    ASSERT_FALSE(inside) << pixel.transpose();
  }
}

TEST(AssumedPoints, TextureWithoutAMatchIsNoWall) {
  Wall wall;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    if (i % kWidth >= kWidth / 2) continue;
    wall.gray[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(i * 131 % 5 * 40 + 20);
  }
  EXPECT_TRUE(wall.assumed().empty());
}

TEST(AssumedPoints, SizesMustAgree) {
  const Wall wall;
  const PointsView cloud(wall.xyz.data(), kWidth, kHeight, 3);
  EXPECT_THROW(assumePoints(cloud, wall.camera, {}, wall.planes), InputError);
  EXPECT_TRUE(evenTiles(wall.gray.data(), 3, 3).empty());
}

}  // namespace
}  // namespace planar_mapping
