// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/register_point_struct.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "planar_mapping/base/random.h"

namespace planar_mapping::test {

/// A user's type whose coordinates are neither first nor in a row.
struct OddPoint {
  double time = 0.0;
  float z = 0.0f;
  std::int16_t ring = 0;
  float x = 0.0f;
  float y = 0.0f;
};

/// A user's type that leaves its fourth coordinate unset.
struct FourthUnsetPoint {
  float x = 0.0f;
  float y = 0.0f;
  float z = 0.0f;
  float w = std::numeric_limits<float>::quiet_NaN();
};

}  // namespace planar_mapping::test

// PCL's own filters, the base of ours, want user-defined types registered.
POINT_CLOUD_REGISTER_POINT_STRUCT(planar_mapping::test::OddPoint,
                                  (float, x, x)(float, y, y)(float, z, z))
POINT_CLOUD_REGISTER_POINT_STRUCT(planar_mapping::test::FourthUnsetPoint,
                                  (float, x, x)(float, y, y)(float, z, z))

namespace planar_mapping::test {

/// 80 x 60 points in a camera's frame (y down): a floor 0.37 m below, a wall 2 m ahead, slight
/// noise. Organized.
template <typename PointT>
typename pcl::PointCloud<PointT>::Ptr makeScene(int width = 80, int height = 60) {
  typename pcl::PointCloud<PointT>::Ptr cloud(new pcl::PointCloud<PointT>);
  Random random(5, 5);
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const double a = (column + 0.5 - 0.5 * width) / width;
      const double b = (row + 0.5 - 0.4 * height) / height;
      const double z = b > 0.0 ? std::min(2.0, 0.37 / b) : 2.0;
      PointT point;
      point.x = static_cast<float>(a * z + 0.001 * random.normal());
      point.y = static_cast<float>(b * z + 0.001 * random.normal());
      point.z = static_cast<float>(z + 0.001 * random.normal());
      cloud->push_back(point);
    }
  }
  cloud->width = static_cast<std::uint32_t>(width);
  cloud->height = static_cast<std::uint32_t>(height);
  cloud->is_dense = true;
  cloud->header.frame_id = "camera";
  cloud->header.stamp = 1234;
  cloud->header.seq = 7;
  return cloud;
}

/// Every fifth point made unusable in one way or another.
template <typename PointT>
std::vector<int> spoil(pcl::PointCloud<PointT>& cloud) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  std::vector<int> spoilt;
  for (std::size_t i = 0; i < cloud.size(); i += 5) {
    PointT& p = cloud[i];
    const std::size_t kind = i / 5 % 4;
    if (kind == 0) p.x = p.y = p.z = nan;
    if (kind == 1) p.y = nan;
    if (kind == 2) p.z = inf;
    if (kind == 3) p.x = -inf;
    spoilt.push_back(static_cast<int>(i));
  }
  cloud.is_dense = false;
  return spoilt;
}

template <typename PointT>
std::vector<float> coordinatesOf(const pcl::PointCloud<PointT>& cloud) {
  std::vector<float> xyz;
  for (const PointT& p : cloud) xyz.insert(xyz.end(), {p.x, p.y, p.z});
  return xyz;
}

}  // namespace planar_mapping::test
