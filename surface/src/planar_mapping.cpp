// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/surface/planar_mapping.h"

namespace planar_mapping {

template class PlanarMapping<pcl::PointXYZ>;
template class PlanarMapping<pcl::PointXYZI>;
template class PlanarMapping<pcl::PointXYZL>;
template class PlanarMapping<pcl::PointXYZRGB>;
template class PlanarMapping<pcl::PointXYZRGBA>;
template class PlanarMapping<pcl::PointNormal>;
template class PlanarMapping<pcl::PointXYZRGBNormal>;
template class PlanarMapping<pcl::PointXYZINormal>;

}  // namespace planar_mapping
