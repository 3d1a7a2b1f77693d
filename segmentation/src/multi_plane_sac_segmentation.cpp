// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

namespace planar_mapping {

template class MultiPlaneSACSegmentation<pcl::PointXYZ>;
template class MultiPlaneSACSegmentation<pcl::PointXYZI>;
template class MultiPlaneSACSegmentation<pcl::PointXYZL>;
template class MultiPlaneSACSegmentation<pcl::PointXYZRGB>;
template class MultiPlaneSACSegmentation<pcl::PointXYZRGBA>;
template class MultiPlaneSACSegmentation<pcl::PointNormal>;
template class MultiPlaneSACSegmentation<pcl::PointXYZRGBNormal>;
template class MultiPlaneSACSegmentation<pcl::PointXYZINormal>;

}  // namespace planar_mapping
