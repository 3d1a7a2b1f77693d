// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping {

PointsView viewOf(const FrameCloud& cloud) {
  static_assert(sizeof(pcl::PointXYZ) % sizeof(float) == 0, "points are read as rows of floats");
  PointsView view(reinterpret_cast<const float*>(cloud.points.data()), cloud.size(),
                  sizeof(pcl::PointXYZ) / sizeof(float));
  view.width = cloud.width;
  view.height = cloud.height;
  return view;
}

}  // namespace planar_mapping
