// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/surface/planar_cuboid_approximation.h"

namespace planar_mapping {

template class PlanarCuboidApproximation<pcl::PointXYZ>;
template class PlanarCuboidApproximation<pcl::PointXYZI>;
template class PlanarCuboidApproximation<pcl::PointXYZL>;
template class PlanarCuboidApproximation<pcl::PointXYZRGB>;
template class PlanarCuboidApproximation<pcl::PointXYZRGBA>;
template class PlanarCuboidApproximation<pcl::PointNormal>;
template class PlanarCuboidApproximation<pcl::PointXYZRGBNormal>;
template class PlanarCuboidApproximation<pcl::PointXYZINormal>;

}  // namespace planar_mapping
