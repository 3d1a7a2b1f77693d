// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Built twice: as Debian builds PCL, and for AVX2, where PCL has a vector path of its own. The
// point type is private to this file, so that nothing comes from the packaged binaries.
#define PCL_NO_PRECOMPILE
#include "peer_pcl.h"

#include <pcl/filters/extract_indices.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/method_types.h>
#include <pcl/sample_consensus/model_types.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <pcl/segmentation/impl/sac_segmentation.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace {
struct EIGEN_ALIGN16 PeerPoint {
  PCL_ADD_POINT4D
  PeerPoint() : data{0, 0, 0, 1} {}
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};
}  // namespace
POINT_CLOUD_REGISTER_POINT_STRUCT(PeerPoint, (float, x, x)(float, y, y)(float, z, z))

extern "C" __attribute__((visibility("default"))) int peerPclPlanes(
    const float* xyz, int count, float distance_threshold, float rest_fraction, int min_inliers,
    int max_planes, int* labels, float* coefficients) {
  using Cloud = pcl::PointCloud<PeerPoint>;
  Cloud::Ptr rest(new Cloud);
  rest->reserve(static_cast<std::size_t>(count));
  std::vector<int> origin(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    PeerPoint p;
    p.x = xyz[3 * i];
    p.y = xyz[3 * i + 1];
    p.z = xyz[3 * i + 2];
    rest->push_back(p);
    origin[static_cast<std::size_t>(i)] = i;
    labels[i] = -1;
  }
  pcl::SACSegmentation<PeerPoint> segmentation;
  segmentation.setOptimizeCoefficients(true);
  segmentation.setModelType(pcl::SACMODEL_PLANE);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setMaxIterations(1000);
  segmentation.setDistanceThreshold(distance_threshold);
  pcl::ExtractIndices<PeerPoint> extract;
  int planes = 0;
  while (rest->size() > rest_fraction * count && planes < max_planes) {
    pcl::PointIndices::Ptr inliers(new pcl::PointIndices);
    pcl::ModelCoefficients model;
    segmentation.setInputCloud(rest);
    segmentation.segment(*inliers, model);
    if (static_cast<int>(inliers->indices.size()) < min_inliers) break;
    std::copy_n(model.values.begin(), 4, coefficients + 4 * planes);
    std::vector<char> taken(rest->size(), 0);
    for (const int i : inliers->indices) {
      taken[static_cast<std::size_t>(i)] = 1;
      labels[origin[static_cast<std::size_t>(i)]] = planes;
    }
    extract.setInputCloud(rest);
    extract.setIndices(inliers);
    extract.setNegative(true);
    Cloud::Ptr next(new Cloud);
    extract.filter(*next);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < taken.size(); ++i) {
      if (!taken[i]) origin[kept++] = origin[i];
    }
    origin.resize(kept);
    rest = next;
    ++planes;
  }
  return planes;
}
