// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdio>
#include <vector>

#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"
#include "planar_mapping/surface/planar_cuboid_approximation.h"

int main() {
  // A wall of 2 m x 1 m, 2 m ahead of a camera.
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (int i = 0; i < 200; ++i) {
    for (int j = 0; j < 100; ++j) cloud->push_back({0.01f * i + 0.005f, 0.01f * j + 0.005f, 2.0f});
  }
  planar_mapping::MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation;
  segmentation.setInputCloud(cloud);
  std::vector<pcl::PointIndices> inliers;
  std::vector<pcl::ModelCoefficients> planes;
  segmentation.segment(inliers, planes);

  // Cuboids are in the world: the cloud's sensor_origin_ and sensor_orientation_ say where that is,
  // or setSensorPose(). Here neither does, and the world is the camera's frame.
  planar_mapping::PlanarCuboidApproximation<pcl::PointXYZ> approximation;
  approximation.setInputCloud(cloud);
  approximation.setPlanes(segmentation.getPlanes());  // all other points are non-planar
  approximation.setUpDirection(-planar_mapping::Vector3::UnitY());  // y is down there
  approximation.setResolution(0.1);                                 // metres
  std::vector<planar_mapping::Cuboid> cuboids;
  approximation.approximate(cuboids);

  std::printf("%zu plane, %zu cuboid\n", planes.size(), cuboids.size());
}
