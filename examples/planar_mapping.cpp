// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Many clouds into one map: planar_mapping [CLOUD.pcd ...], each with its pose as VIEWPOINT.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdio>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/cloud_file.h"
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"
#include "planar_mapping/surface/planar_mapping.h"

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

struct Frame {
  Cloud::Ptr cloud{new Cloud};
  planar_mapping::Pose T_world_sensor = planar_mapping::Pose::Identity();
};

Frame read(const char* path) {
  const planar_mapping::io::CloudData file = planar_mapping::io::readCloudFile(path);
  Frame frame;
  frame.T_world_sensor = file.T_world_sensor;
  for (std::size_t i = 0; i < file.size(); ++i) {
    frame.cloud->push_back({file.xyz[3 * i], file.xyz[3 * i + 1], file.xyz[3 * i + 2]});
  }
  return frame;
}

/// A floor and a wall, seen from places half a metre apart along y.
std::vector<Frame> generate() {
  std::vector<Frame> frames(3);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    frames[k].T_world_sensor.translation().y() = 0.5 * static_cast<double>(k);
    for (int i = 0; i < 100; ++i) {
      for (int j = 0; j < 100; ++j) {
        frames[k].cloud->push_back({0.02f * i + 1.0f, 0.02f * j - 1.0f, -0.5f});
        frames[k].cloud->push_back({3.0f, 0.02f * j - 1.0f, 0.02f * i - 0.45f});
      }
    }
  }
  return frames;
}

int main(int argc, char** argv) try {
  std::vector<Frame> frames = argc > 1 ? std::vector<Frame>() : generate();
  for (int i = 1; i < argc; ++i) frames.push_back(read(argv[i]));

  planar_mapping::MultiPlaneSACSegmentation<pcl::PointXYZ> segmentation;
  segmentation.setDistanceThreshold(0.05);  // metres
  segmentation.setMinInliers(100);          // points of the smallest plane
  planar_mapping::PlanarMapping<pcl::PointXYZ> mapping;
  mapping.setResolution(0.1);  // metres
  for (const Frame& frame : frames) {
    segmentation.setInputCloud(frame.cloud);
    segmentation.segment();
    mapping.setInputCloud(frame.cloud);
    mapping.setSensorPose(frame.T_world_sensor);
    mapping.setPlanes(segmentation.getPlanes());
    mapping.integrate();
  }

  const planar_mapping::PlanarMap& map = mapping.map();
  std::printf("%zu frames, %zu planes, %zu cuboids\n", map.frames(), map.planes().size(),
              map.cuboids().size());
} catch (const planar_mapping::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
