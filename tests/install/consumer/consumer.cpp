// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A stranger's program with a point type of its own, built against the installed package.
#include <pcl/point_cloud.h>
#include <pcl/register_point_struct.h>

#include <cstdio>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/filters/ground_removal.h"
#include "planar_mapping/filters/kl_occupancy_filter.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"
#include "planar_mapping/surface/planar_cuboid_approximation.h"

struct StrangersPoint {
  int id = 0;
  float x = 0.0f, y = 0.0f, z = 0.0f;
};

POINT_CLOUD_REGISTER_POINT_STRUCT(StrangersPoint, (float, x, x)(float, y, y)(float, z, z))

int main() {
  using Cloud = pcl::PointCloud<StrangersPoint>;
  Cloud::Ptr cloud(new Cloud);
  for (int i = 0; i < 100; ++i) {
    for (int j = 0; j < 100; ++j) {
      cloud->push_back({i, 0.02f * i - 1.0f, 0.37f, 0.02f * j + 1.0f});
      cloud->push_back({i, 0.02f * i - 1.0f, 0.32f - 0.02f * j, 3.0f});
    }
  }
  planar_mapping::GroundRemoval<StrangersPoint> ground;
  ground.setInputCloud(cloud);
  Cloud::Ptr obstacles(new Cloud);
  ground.filter(*obstacles);

  planar_mapping::KLOccupancyFilter<StrangersPoint> occupancy;
  occupancy.setInputCloud(obstacles);
  Cloud::Ptr believed(new Cloud);
  occupancy.filter(*believed);

  planar_mapping::MultiPlaneSACSegmentation<StrangersPoint> segmentation;
  segmentation.setInputCloud(obstacles);
  std::vector<pcl::PointIndices> inliers;
  std::vector<pcl::ModelCoefficients> planes;
  segmentation.segment(inliers, planes);

  planar_mapping::PlanarCuboidApproximation<StrangersPoint> approximation;
  approximation.setInputCloud(obstacles);
  approximation.setPlanes(segmentation.getPlanes());
  std::vector<planar_mapping::Cuboid> cuboids;
  approximation.approximate(cuboids);

  bool thrown = false;
  try {
    segmentation.setDistanceThreshold(-1.0);
  } catch (const planar_mapping::ParameterError&) {
    thrown = true;
  }
  if (ground.getGround().found && obstacles->size() == 10000 && planes.size() == 1 &&
      !cuboids.empty() && !believed->empty() && thrown) {
    std::puts("consumer works");
  } else {
    std::printf("%d %zu %zu %zu %zu %d\n", ground.getGround().found, obstacles->size(),
                planes.size(), cuboids.size(), believed->size(), thrown);
  }
}
