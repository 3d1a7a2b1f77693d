// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/PolygonMesh.h>
#include <pcl/memory.h>
#include <pcl/point_cloud.h>
#include <pcl/surface/reconstruction.h>

#include <string>
#include <vector>

#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/pcl/point_types.h"
#include "planar_mapping/surface/mapping_input.h"

namespace planar_mapping {

/// Approximates a cloud by oriented rectangular cuboids (the paper, III-F): the points of each
/// plane by cuboids that lie in it, all others by cuboids of their own. It is one frame of
/// PlanarMapping, and gives the cuboids of `planar_map run` for the same cloud and parameters.
///
/// \code
/// planar_mapping::PlanarCuboidApproximation<pcl::PointXYZ> approximation;
/// approximation.setInputCloud(cloud);
/// approximation.setPlanes(segmentation.getPlanes());  // of MultiPlaneSACSegmentation
/// approximation.setResolution(0.1);                   // s, metres
/// std::vector<planar_mapping::Cuboid> cuboids;
/// approximation.approximate(cuboids);
/// \endcode
///
/// The front of a planar cuboid is its plane, from where it extends away from the sensor;
/// Cuboid::plane_id counts the planes of setPlanes() that have points. Points that are not finite
/// are skipped and counted as dropped. The same input and parameters give the same result on any
/// number of threads. The class prints nothing and keeps nothing between runs but the diagnostics.
template <typename PointT>
class PLANAR_MAPPING_EXPORT PlanarCuboidApproximation : public pcl::PCLSurfaceBase<PointT>,
                                                        public MappingInput {
 public:
  using Ptr = pcl::shared_ptr<PlanarCuboidApproximation<PointT>>;
  using ConstPtr = pcl::shared_ptr<const PlanarCuboidApproximation<PointT>>;
  using PointCloud = typename pcl::PCLBase<PointT>::PointCloud;
  using PointCloudPtr = typename pcl::PCLBase<PointT>::PointCloudPtr;
  using PointCloudConstPtr = typename pcl::PCLBase<PointT>::PointCloudConstPtr;

  /// The parameters are those of a map, but that free and unknown space are not kept.
  PlanarCuboidApproximation() : MappingInput(paramsWithoutSpace()) {}

  /// Approximates the input cloud, or the points of setIndices().
  /// \param[out] cuboids in the world: planar ones plane by plane, then the non-planar ones
  /// \throws InputError as PlanarMapping::integrate()
  void approximate(std::vector<Cuboid>& cuboids);

  /// As approximate(), as a mesh: eight vertices and six outward quadrilaterals for each cuboid.
  void reconstruct(pcl::PolygonMesh& mesh) override;

  /// What the last run did.
  const FrameUpdate& getDiagnostics() const { return diagnostics_; }

 protected:
  std::string getClassName() const override { return "PlanarCuboidApproximation"; }

 private:
  static PlanarMapParams paramsWithoutSpace() {
    PlanarMapParams params;
    params.unknown_space = false;
    return params;
  }

  FrameUpdate diagnostics_;
};

PLANAR_MAPPING_FOR_POINT_TYPES(extern template class PLANAR_MAPPING_EXPORT,
                               PlanarCuboidApproximation)

}  // namespace planar_mapping

#include "planar_mapping/surface/impl/planar_cuboid_approximation.hpp"
