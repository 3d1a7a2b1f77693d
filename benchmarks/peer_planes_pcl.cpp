// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <dlfcn.h>
#include <pcl/ModelCoefficients.h>
#include <pcl/features/integral_image_normal.h>
#include <pcl/features/normal_3d.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/organized_multi_plane_segmentation.h>
#include <pcl/segmentation/region_growing.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "peer_pcl.h"
#include "peer_planes.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/plane_moments.h"

namespace {

using planar_mapping::PlaneSegment;
using planar_mapping::PointsView;
using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Normals = pcl::PointCloud<pcl::Normal>;

Cloud::Ptr cloudOf(const PointsView& points, const std::vector<int>* indices) {
  Cloud::Ptr cloud(new Cloud);
  const std::size_t size = indices ? indices->size() : points.size;
  cloud->resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t from = indices ? static_cast<std::size_t>((*indices)[i]) : i;
    const bool finite = points.isMeasured(from);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float* p = points[from];
    (*cloud)[i] = finite ? pcl::PointXYZ(p[0], p[1], p[2]) : pcl::PointXYZ(nan, nan, nan);
  }
  cloud->width = indices ? static_cast<std::uint32_t>(size) : points.width;
  cloud->height = indices ? 1 : points.height;
  cloud->is_dense = indices != nullptr;
  return cloud;
}

/// PCL's loop as built for AVX2, which is the same search 14 to 21 times as fast as packaged.
std::vector<PlaneSegment> sacLoop(const PeerTask& task, float rest_fraction) {
  static const auto search = [] {
    void* library = dlopen(PEER_PCL_AVX2, RTLD_NOW | RTLD_LOCAL);
    void* symbol = library != nullptr ? dlsym(library, "peerPclPlanes") : nullptr;
    if (symbol == nullptr) throw planar_mapping::InputError("PCL's loop cannot be loaded");
    return reinterpret_cast<decltype(&peerPclPlanes)>(symbol);
  }();
  constexpr int kMaxPlanes = 80;
  const std::vector<int> origin = finiteOf(task.points);
  std::vector<float> xyz;
  xyz.reserve(3 * origin.size());
  for (const int i : origin) {
    const float* p = task.points[static_cast<std::size_t>(i)];
    xyz.insert(xyz.end(), p, p + 3);
  }
  std::vector<int> labels(origin.size());
  std::vector<float> models(4 * kMaxPlanes);
  const int planes =
      search(xyz.data(), static_cast<int>(origin.size()), static_cast<float>(task.distance),
             rest_fraction, task.min_inliers, kMaxPlanes, labels.data(), models.data());
  std::vector<PlaneSegment> found(static_cast<std::size_t>(planes));
  for (std::size_t k = 0; k < found.size(); ++k) {
    const float* m = &models[4 * k];
    found[k].plane = planar_mapping::planeFromCoefficients(m[0], m[1], m[2], m[3]);
  }
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] >= 0) found[static_cast<std::size_t>(labels[i])].inliers.push_back(origin[i]);
  }
  return found;
}

std::vector<PlaneSegment> tutorialLoop(const PeerTask& task) {
  return sacLoop(task, 0.3F);
}

std::vector<PlaneSegment> exhaustiveLoop(const PeerTask& task) {
  return sacLoop(task, 0.0F);
}

/// Without normals OMPS ends the program: integral images give them, as in PCL's own example.
std::vector<PlaneSegment> organizedMultiPlane(const PeerTask& task) {
  const Cloud::Ptr cloud = cloudOf(task.points, nullptr);
  Normals::Ptr normals(new Normals);
  pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setNormalEstimationMethod(estimation.COVARIANCE_MATRIX);
  estimation.setMaxDepthChangeFactor(0.03F);
  estimation.setNormalSmoothingSize(std::min(20.0F, 0.05F * static_cast<float>(cloud->width)));
  estimation.setInputCloud(cloud);
  estimation.compute(*normals);
  pcl::OrganizedMultiPlaneSegmentation<pcl::PointXYZ, pcl::Normal, pcl::Label> search;
  search.setMinInliers(static_cast<unsigned>(task.min_inliers));
  search.setAngularThreshold(task.angle);
  search.setDistanceThreshold(task.distance);
  search.setInputNormals(normals);
  search.setInputCloud(cloud);
  std::vector<pcl::PlanarRegion<pcl::PointXYZ>,
              Eigen::aligned_allocator<pcl::PlanarRegion<pcl::PointXYZ>>>
      regions;
  std::vector<pcl::ModelCoefficients> models;
  std::vector<pcl::PointIndices> inliers, label_indices, boundaries;
  pcl::PointCloud<pcl::Label>::Ptr labels(new pcl::PointCloud<pcl::Label>);
  search.segmentAndRefine(regions, models, inliers, labels, label_indices, boundaries);
  // Refinement may give a pixel to two planes: the first keeps it.
  std::vector<char> taken(task.points.size, 0);
  std::vector<PlaneSegment> found;
  for (std::size_t k = 0; k < inliers.size(); ++k) {
    std::vector<int> own;
    for (const int i : inliers[k].indices) {
      char& mark = taken[static_cast<std::size_t>(i)];
      if (!mark) own.push_back(i);
      mark = 1;
    }
    PlaneSegment segment = fitted(task.points, std::move(own));
    // Refinement leaves some planes undefined.
    const std::vector<float>& m = models[k].values;
    if (std::isfinite(m[0] + m[1] + m[2] + m[3])) {
      segment.plane = planar_mapping::planeFromCoefficients(m[0], m[1], m[2], m[3]);
    }
    found.push_back(std::move(segment));
  }
  return found;
}

std::vector<PlaneSegment> regionGrowing(const PeerTask& task) {
  const std::vector<int> origin = finiteOf(task.points);
  const Cloud::Ptr cloud = cloudOf(task.points, &origin);
  pcl::search::KdTree<pcl::PointXYZ>::Ptr tree(new pcl::search::KdTree<pcl::PointXYZ>);
  Normals::Ptr normals(new Normals);
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(cloud);
  estimation.setSearchMethod(tree);
  estimation.setKSearch(task.neighbours);
  estimation.compute(*normals);
  pcl::RegionGrowing<pcl::PointXYZ, pcl::Normal> search;
  search.setMinClusterSize(task.min_inliers);
  search.setMaxClusterSize(std::numeric_limits<int>::max());
  search.setSearchMethod(tree);
  search.setNumberOfNeighbours(static_cast<unsigned>(task.neighbours));
  search.setInputCloud(cloud);
  search.setInputNormals(normals);
  search.setSmoothnessThreshold(static_cast<float>(task.smoothness));
  search.setCurvatureThreshold(0.05F);
  std::vector<pcl::PointIndices> clusters;
  search.extract(clusters);
  std::vector<PlaneSegment> found;
  for (const pcl::PointIndices& cluster : clusters) {
    std::vector<int> inliers;
    for (const int i : cluster.indices) inliers.push_back(origin[static_cast<std::size_t>(i)]);
    found.push_back(fitted(task.points, std::move(inliers)));
  }
  return found;
}

}  // namespace

std::vector<int> finiteOf(const PointsView& points) {
  std::vector<int> finite;
  for (std::size_t i = 0; i < points.size; ++i) {
    if (points.isMeasured(i)) finite.push_back(static_cast<int>(i));
  }
  return finite;
}

PlaneSegment fitted(const PointsView& points, std::vector<int> inliers) {
  planar_mapping::PlaneMoments moments;
  for (const int i : inliers) moments.add(points.point(static_cast<std::size_t>(i)));
  PlaneSegment segment;
  segment.plane = moments.fit().plane;
  segment.inliers = std::move(inliers);
  return segment;
}

std::vector<Peer> pclPeers() {
  return {{"PCL RANSAC loop, 30 % left", false, tutorialLoop},
          {"PCL RANSAC loop, exhaustive", false, exhaustiveLoop},
          {"PCL organized multi-plane", true, organizedMultiPlane},
          {"PCL region growing", false, regionGrowing}};
}
