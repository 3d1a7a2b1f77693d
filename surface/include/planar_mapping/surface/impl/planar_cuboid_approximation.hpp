// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/impl/pcl_base.hpp>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pcl/points_view.h"
#include "planar_mapping/pcl/sensor_pose.h"
#include "planar_mapping/surface/cuboid_mesh.h"
#include "planar_mapping/surface/planar_cuboid_approximation.h"

namespace planar_mapping {

template <typename PointT>
void PlanarCuboidApproximation<PointT>::approximate(std::vector<Cuboid>& cuboids) {
  cuboids.clear();
  diagnostics_ = FrameUpdate();
  if (!this->input_) throw InputError("PlanarCuboidApproximation has no input cloud");
  const PointCloud& cloud = *this->input_;
  const Indices* indices = this->use_indices_ && this->indices_ ? this->indices_.get() : nullptr;
  const CloudView points = viewOf(cloud);
  const Pose T_world_sensor = sensorPoseOf(cloud, getSensorPose());
  PlanarMap map(paramsFor(points, indices, T_world_sensor));
  diagnostics_ = insertInto(map, points, indices, T_world_sensor, cloud.header.stamp);
  cuboids = map.cuboids();
}

template <typename PointT>
void PlanarCuboidApproximation<PointT>::reconstruct(pcl::PolygonMesh& mesh) {
  mesh = pcl::PolygonMesh();
  std::vector<Cuboid> cuboids;
  approximate(cuboids);
  mesh.header = this->input_->header;
  writeMesh(cuboids, mesh);
}

}  // namespace planar_mapping
