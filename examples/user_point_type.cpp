// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A point type of the caller's own. PCL_NO_PRECOMPILE is not needed; PCL's filters want the type
// registered, the other classes do not.
#include <pcl/point_cloud.h>
#include <pcl/register_point_struct.h>

#include <cstdio>
#include <vector>

#include "planar_mapping/filters/ground_removal.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

struct MyPoint {
  double time = 0.0;
  int sensor = 0;
  float x = 0.0f, y = 0.0f, z = 0.0f;
};

POINT_CLOUD_REGISTER_POINT_STRUCT(MyPoint, (float, x, x)(float, y, y)(float, z, z))

int main() {
  pcl::PointCloud<MyPoint>::Ptr cloud(new pcl::PointCloud<MyPoint>);
  for (int i = 0; i < 100; ++i) {
    for (int j = 0; j < 100; ++j) {
      cloud->push_back({0.0, 1, 0.02f * i - 1.0f, 0.37f, 0.02f * j + 1.0f});
      cloud->push_back({0.0, 2, 0.02f * i - 1.0f, 0.32f - 0.02f * j, 3.0f});
    }
  }
  planar_mapping::MultiPlaneSACSegmentation<MyPoint> segmentation;
  segmentation.setInputCloud(cloud);
  std::vector<pcl::PointIndices> inliers;
  std::vector<pcl::ModelCoefficients> planes;
  segmentation.segment(inliers, planes);
  std::printf("%zu planes of my points\n", planes.size());

  planar_mapping::GroundRemoval<MyPoint> ground;
  ground.setInputCloud(cloud);
  pcl::PointCloud<MyPoint> obstacles;
  ground.filter(obstacles);
  std::printf("%zu points over the ground\n", obstacles.size());
}
