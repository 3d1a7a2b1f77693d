// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/filters/ground_removal.h"

namespace planar_mapping {

template class GroundRemoval<pcl::PointXYZ>;
template class GroundRemoval<pcl::PointXYZI>;
template class GroundRemoval<pcl::PointXYZL>;

}  // namespace planar_mapping
