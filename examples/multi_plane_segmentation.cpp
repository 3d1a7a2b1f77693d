// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdio>
#include <vector>

#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

int main() {
  // A floor and a wall.
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (int i = 0; i < 100; ++i) {
    for (int j = 0; j < 100; ++j) {
      cloud->push_back({0.02f * i - 1.0f, 0.5f, 0.02f * j + 1.0f});
      cloud->push_back({0.02f * i - 1.0f, 0.45f - 0.02f * j, 3.0f});
    }
  }

  planar_mapping::MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation;
  segmentation.setDistanceThreshold(0.05);  // metres
  segmentation.setMinInliers(1000);
  segmentation.setInputCloud(cloud);
  std::vector<pcl::PointIndices> inliers;
  std::vector<pcl::ModelCoefficients> planes;
  segmentation.segment(inliers, planes);

  std::printf("%zu planes\n", planes.size());
}
