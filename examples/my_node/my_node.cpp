// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The cuboids of a PCD file: my_node CLOUD.pcd
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <cstdio>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"
#include "planar_mapping/surface/planar_cuboid_approximation.h"

int main(int argc, char** argv) try {
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  if (argc != 2 || pcl::io::loadPCDFile(argv[1], *cloud) != 0) {
    std::fprintf(stderr, "usage: my_node CLOUD.pcd\n");
    return 1;
  }

  planar_mapping::MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation;
  segmentation.setInputCloud(cloud);
  segmentation.segment();

  planar_mapping::PlanarCuboidApproximation<pcl::PointXYZ> approximation;
  approximation.setInputCloud(cloud);
  approximation.setPlanes(segmentation.getPlanes());
  std::vector<planar_mapping::Cuboid> cuboids;
  approximation.approximate(cuboids);

  std::printf("%zu planes, %zu cuboids\n", segmentation.getPlanes().size(), cuboids.size());
} catch (const planar_mapping::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
