// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_types.h>

/// The point types that the class templates are compiled for: `how Class<PointT>;` for each.
#define PLANAR_MAPPING_FOR_POINT_TYPES(how, Class) \
  how Class<pcl::PointXYZ>;                        \
  how Class<pcl::PointXYZI>;                       \
  how Class<pcl::PointXYZL>;                       \
  how Class<pcl::PointXYZRGB>;                     \
  how Class<pcl::PointXYZRGBA>;                    \
  how Class<pcl::PointNormal>;                     \
  how Class<pcl::PointXYZRGBNormal>;               \
  how Class<pcl::PointXYZINormal>;
