// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/segmentation/multi_plane_sac_segmentation.h"

namespace planar_mapping {

template class MultiPlaneSACSegmentation<pcl::PointXYZRGB>;
template class MultiPlaneSACSegmentation<pcl::PointXYZRGBA>;

}  // namespace planar_mapping
