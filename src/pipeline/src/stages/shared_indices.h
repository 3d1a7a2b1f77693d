// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/pcl_base.h>

#include "planar_mapping/core/base/types.h"

namespace planar_mapping::detail {

/// The indices as PCL's classes take them: not copied, and not owned.
inline pcl::IndicesPtr sharedIndices(Indices& indices) {
  return pcl::IndicesPtr(pcl::IndicesPtr(), &indices);
}

}  // namespace planar_mapping::detail
