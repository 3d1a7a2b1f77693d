// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdio>

#include "planar_mapping/filters/ground_removal.h"

int main() {
  // A floor 0.37 m under a camera (x right, y down, z forward) and a box on it.
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (int i = -100; i < 100; ++i) {
    for (int j = 50; j < 250; ++j) cloud->push_back({0.01f * i, 0.37f, 0.01f * j});
  }
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) cloud->push_back({0.01f * i, 0.3f - 0.01f * j, 1.5f});
  }

  planar_mapping::GroundRemoval<pcl::PointXYZ> ground;
  ground.setInputCloud(cloud);
  pcl::PointCloud<pcl::PointXYZ> obstacles;
  ground.filter(obstacles);

  // The height of the camera was found; ground.setCameraHeight() says it where it is known.
  std::printf("ground %.2f m below the camera, %zu points stand on it\n", ground.getGround().height,
              obstacles.size());
}
