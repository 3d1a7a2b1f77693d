// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/impl/pcl_base.hpp>

#include "planar_mapping/base/error.h"
#include "planar_mapping/pcl/points_view.h"
#include "planar_mapping/pcl/sensor_pose.h"
#include "planar_mapping/surface/planar_mapping.h"

namespace planar_mapping {

template <typename PointT>
FrameUpdate PlanarMapping<PointT>::integrate() {
  diagnostics_ = FrameUpdate();
  if (!this->input_) throw InputError("PlanarMapping has no input cloud");
  const PointCloud& cloud = *this->input_;
  const Indices* indices = this->use_indices_ && this->indices_ ? this->indices_.get() : nullptr;
  const CloudView points = viewOf(cloud);
  const Pose T_world_sensor = sensorPoseOf(cloud, getSensorPose());
  if (map_ == nullptr && own_map_.frames() == 0) {
    own_map_ = PlanarMap(paramsFor(points, indices, T_world_sensor));
  }
  diagnostics_ = insertInto(map_ != nullptr ? *map_ : own_map_, points, indices, T_world_sensor,
                            cloud.header.stamp);
  diagnostics_.merged_cloud =
      map_ == nullptr && getParams().unknown_space && !own_map_.params().unknown_space;
  return diagnostics_;
}

template <typename PointT>
void PlanarMapping<PointT>::reset() {
  map_ = nullptr;
  own_map_ = PlanarMap(getParams());
  diagnostics_ = FrameUpdate();
}

}  // namespace planar_mapping
