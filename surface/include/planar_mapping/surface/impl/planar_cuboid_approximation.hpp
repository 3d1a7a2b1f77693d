// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/impl/pcl_base.hpp>
#include <string>
#include <utility>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/pcl/parameter_setter.h"
#include "planar_mapping/pcl/points_view.h"
#include "planar_mapping/surface/cuboid_mesh.h"
#include "planar_mapping/surface/planar_cuboid_approximation.h"

namespace planar_mapping {

template <typename PointT>
void PlanarCuboidApproximation<PointT>::approximate(std::vector<Cuboid>& cuboids) {
  cuboids.clear();
  diagnostics_ = CuboidApproximationDiagnostics();
  if (!this->input_) throw InputError("PlanarCuboidApproximation has no input cloud");
  const PointCloud& cloud = *this->input_;
  const Indices* indices = this->use_indices_ && this->indices_ ? this->indices_.get() : nullptr;
  const Vector3 sensor = cloud.sensor_origin_.template head<3>().template cast<double>();
  cuboids = approximateCuboids(viewOf(cloud), indices, planes_, params_, sensor,
                               probabilities_.empty() ? nullptr : &probabilities_, &diagnostics_);
}

template <typename PointT>
void PlanarCuboidApproximation<PointT>::reconstruct(pcl::PolygonMesh& mesh) {
  mesh = pcl::PolygonMesh();
  std::vector<Cuboid> cuboids;
  approximate(cuboids);
  mesh.header = this->input_->header;
  writeMesh(cuboids, mesh);
}

template <typename PointT>
void PlanarCuboidApproximation<PointT>::setPlanes(
    const std::vector<pcl::PointIndices>& inliers,
    const std::vector<pcl::ModelCoefficients>& planes) {
  if (inliers.size() != planes.size()) {
    throw InputError(std::to_string(planes.size()) + " planes come with " +
                     std::to_string(inliers.size()) + " sets of inliers");
  }
  std::vector<PlaneSegment> segments(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const std::vector<float>& c = planes[i].values;
    if (c.size() != 4) {
      throw InputError("plane " + std::to_string(i) + " has " + std::to_string(c.size()) +
                       " coefficients instead of 4");
    }
    segments[i].plane = planeFromCoefficients(c[0], c[1], c[2], c[3]);
    segments[i].inliers = inliers[i].indices;
  }
  planes_ = std::move(segments);
}

template <typename PointT>
void PlanarCuboidApproximation<PointT>::setParams(const CuboidApproximationParams& params) {
  params.validate();
  params_ = params;
}

PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setProfile, Profile, profile)
PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setResolution, double, resolution)
PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setThickness, double, thickness)
PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setDensityThreshold, double,
                                density_threshold)
PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setMinWidth, double, min_width)
PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setMinHeight, double, min_height)
PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setMinPointsPerCell, int,
                                min_points_per_cell)
PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setHoleSize, double, hole_size)
PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setAbsorption, double, absorption)
PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setUpDirection, const Vector3&, up)
PLANAR_MAPPING_PARAMETER_SETTER(PlanarCuboidApproximation, setNumberOfThreads, int, threads)

}  // namespace planar_mapping
