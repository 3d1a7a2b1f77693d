// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdio>

#include "planar_mapping/filters/kl_occupancy_filter.h"

int main() {
  // Three features of one wall seen in two frames; meanwhile the camera moves 0.1 m ahead, and the
  // third feature is not where it should be: a mismatch.
  pcl::PointCloud<pcl::PointXYZ>::Ptr first(new pcl::PointCloud<pcl::PointXYZ>);
  first->push_back({0.51f, 0.01f, 2.01f});
  first->push_back({0.55f, 0.02f, 2.01f});
  first->push_back({0.58f, 0.06f, 2.01f});
  pcl::PointCloud<pcl::PointXYZ>::Ptr second(new pcl::PointCloud<pcl::PointXYZ>(*first));
  for (pcl::PointXYZ& p : *second) p.z -= 0.1f;
  second->points[2].x -= 0.2f;

  planar_mapping::KLOccupancyFilter<pcl::PointXYZ> occupancy;
  occupancy.setInputTracks({101, 102, 103});  // one identity per point
  occupancy.setMinProbability(0.5);
  pcl::PointCloud<pcl::PointXYZ> believed;
  occupancy.setInputCloud(first);
  occupancy.filter(believed);

  planar_mapping::Pose motion = planar_mapping::Pose::Identity();  // T_now_before
  motion.translation().z() = -0.1;
  occupancy.setMotion(motion, 1e-6 * planar_mapping::Matrix6::Identity());
  occupancy.setInputCloud(second);
  occupancy.filter(believed);

  std::printf("%zu of %zu features are believed\n", believed.size(), second->size());
}
