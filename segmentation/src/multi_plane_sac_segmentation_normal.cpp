// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

namespace planar_mapping {

template class MultiPlaneSACSegmentation<pcl::PointNormal>;
template class MultiPlaneSACSegmentation<pcl::PointXYZRGBNormal>;
template class MultiPlaneSACSegmentation<pcl::PointXYZINormal>;

}  // namespace planar_mapping
