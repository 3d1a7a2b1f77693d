// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/filters/ground_removal.h"

namespace planar_mapping {

template class GroundRemoval<pcl::PointXYZ>;
template class GroundRemoval<pcl::PointXYZI>;
template class GroundRemoval<pcl::PointXYZL>;
template class GroundRemoval<pcl::PointXYZRGB>;
template class GroundRemoval<pcl::PointXYZRGBA>;
template class GroundRemoval<pcl::PointNormal>;
template class GroundRemoval<pcl::PointXYZRGBNormal>;
template class GroundRemoval<pcl::PointXYZINormal>;

}  // namespace planar_mapping
