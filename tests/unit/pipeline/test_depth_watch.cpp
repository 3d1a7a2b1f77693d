// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "advice/watches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "planar_mapping/core/geometry/camera.h"

namespace planar_mapping::detail {
namespace {

/// A corner of a room, 4 m away, as a camera with a field of 65 degrees sees it.
/// \param along_ray  as distances, which are taken for depths
std::vector<float> corner(bool along_ray) {
  const PinholeCamera camera{250.0, 250.0, 159.5, 119.5, 320, 240};
  std::vector<float> xyz;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const Vector3 ray = camera.rayOf(column, row);
      const Vector3 left = Vector3(-0.6, 0.0, 0.8);
      const Vector3 right = Vector3(0.8, 0.0, 0.6);
      double depth = 1e9;
      for (const auto& [normal, distance] :
           {std::pair(left, 3.2), std::pair(right, 2.4), std::pair(Vector3(0.0, 1.0, 0.0), 1.2)}) {
        const double along = normal.dot(ray);
        if (along > 0.0) depth = std::min(depth, distance / along);
      }
      if (along_ray) depth *= ray.norm();
      for (int k = 0; k < 3; ++k) xyz.push_back(static_cast<float>(depth * ray[k]));
    }
  }
  return xyz;
}

TEST(DepthWatch, DistancesAlongRaysAreSaidOnceInTheSecondFrame) {
  const std::vector<float> xyz = corner(true);
  const PointsView points(xyz.data(), 320, 240, 3);
  DepthWatch watch;
  EXPECT_FALSE(watch.isBentIn(points, false));
  EXPECT_TRUE(watch.isBentIn(points, false));
  EXPECT_FALSE(watch.isBentIn(points, false));
  EXPECT_TRUE(DepthWatch().isBentIn(points, true));
}

TEST(DepthWatch, DepthsAlongTheAxisSayNothing) {
  const std::vector<float> xyz = corner(false);
  DepthWatch watch;
  for (int frame = 0; frame < 6; ++frame) {
    EXPECT_FALSE(watch.isBentIn(PointsView(xyz.data(), 320, 240, 3), false)) << frame;
  }
  EXPECT_FALSE(DepthWatch().isBentIn(PointsView(xyz.data(), 320, 240, 3), true));
}

}  // namespace
}  // namespace planar_mapping::detail
