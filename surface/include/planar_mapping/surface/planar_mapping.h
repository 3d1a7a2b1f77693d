// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/memory.h>
#include <pcl/pcl_base.h>
#include <pcl/point_cloud.h>

#include "planar_mapping/pcl/point_types.h"
#include "planar_mapping/surface/mapping_input.h"

namespace planar_mapping {

/// Builds a map of cuboids from many clouds (the paper, III-F and IV), as `planar_map run` does.
///
/// \code
/// planar_mapping::PlanarMapping<pcl::PointXYZ> mapping;
/// mapping.setResolution(0.1);                     // s, metres
/// for (const auto& cloud : clouds) {
///   segmentation.setInputCloud(cloud);            // MultiPlaneSACSegmentation
///   segmentation.segment(inliers, planes);
///   mapping.setInputCloud(cloud);
///   mapping.setSensorPose(poseOf(cloud));         // T_world_sensor; else the cloud's VIEWPOINT
///   mapping.setPlanes(segmentation.getPlanes());
///   mapping.integrate();
/// }
/// for (const planar_mapping::Cuboid& cuboid : mapping.map().cuboids()) ...
/// \endcode
///
/// The same input and parameters give the same map on any number of threads. The class prints
/// nothing. Between frames it keeps the map, which reset() empties. A copy has a map of its own,
/// unless setMap() was called: then both work on the same one.
template <typename PointT>
class PLANAR_MAPPING_EXPORT PlanarMapping : public pcl::PCLBase<PointT>, public MappingInput {
 public:
  using Ptr = pcl::shared_ptr<PlanarMapping<PointT>>;
  using ConstPtr = pcl::shared_ptr<const PlanarMapping<PointT>>;
  using PointCloud = typename pcl::PCLBase<PointT>::PointCloud;
  using PointCloudPtr = typename pcl::PCLBase<PointT>::PointCloudPtr;
  using PointCloudConstPtr = typename pcl::PCLBase<PointT>::PointCloudConstPtr;

  /// Adds the input cloud, or the points of setIndices(), to the map. Parameters hold from the
  /// first frame of a map to its last: later changes from the next reset().
  /// \throws InputError without an input cloud; for an index or inlier outside it, sizes that
  ///         disagree, a pose that is no rigid motion or beyond PlanarMap::kReach; or if the first
  ///         cloud is not in metres
  FrameUpdate integrate();

  /// The map so far.
  const PlanarMap& map() const { return map_ != nullptr ? *map_ : own_map_; }
  /// Works on the caller's map, which must outlive this object and has its own parameters.
  void setMap(PlanarMap& map) { map_ = &map; }
  /// Starts again with an empty map of its own.
  void reset();

  /// What the last integrate() did.
  const FrameUpdate& getDiagnostics() const { return diagnostics_; }

 private:
  PlanarMap* map_ = nullptr;
  PlanarMap own_map_;
  FrameUpdate diagnostics_;
};

PLANAR_MAPPING_FOR_POINT_TYPES(extern template class PLANAR_MAPPING_EXPORT, PlanarMapping)

}  // namespace planar_mapping

#include "planar_mapping/surface/impl/planar_mapping.hpp"
