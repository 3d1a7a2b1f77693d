// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/impl/pcl_base.hpp>

#include "planar_mapping/core/base/error.h"
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
  if (map_ == nullptr && own_map_.frames() == 0) own_map_ = PlanarMap(getParams());
  diagnostics_ = insertInto(map_ != nullptr ? *map_ : own_map_, viewOf(cloud), indices,
                            sensorPoseOf(cloud, getSensorPose()), cloud.header.stamp);
  return diagnostics_;
}

template <typename PointT>
void PlanarMapping<PointT>::reset() {
  map_ = nullptr;
  own_map_ = PlanarMap(getParams());
  diagnostics_ = FrameUpdate();
}

}  // namespace planar_mapping
