// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/filters/kl_occupancy_filter.h"

namespace planar_mapping {

template class KLOccupancyFilter<pcl::PointXYZ>;
template class KLOccupancyFilter<pcl::PointXYZI>;
template class KLOccupancyFilter<pcl::PointXYZL>;
template class KLOccupancyFilter<pcl::PointXYZRGB>;
template class KLOccupancyFilter<pcl::PointXYZRGBA>;
template class KLOccupancyFilter<pcl::PointNormal>;
template class KLOccupancyFilter<pcl::PointXYZRGBNormal>;
template class KLOccupancyFilter<pcl::PointXYZINormal>;

}  // namespace planar_mapping
