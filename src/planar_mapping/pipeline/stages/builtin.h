// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/pcl_base.h>

#include "planar_mapping/base/types.h"
#include "planar_mapping/pipeline/stage_table.h"

namespace planar_mapping::detail {

/// The indices as PCL's classes take them: not copied, and not owned.
inline pcl::IndicesPtr sharedIndices(Indices& indices) {
  return pcl::IndicesPtr(pcl::IndicesPtr(), &indices);
}

// Each group of stages adds itself; registerBuiltinStages() calls these in the order of a chain.
using AddStages = void(StageTable& table);
AddStages addStereoMatching, addKeyFeatures, addMotionEstimation, addPointFilters, addGroundRemoval,
    addMultiPlaneSegmentation, addKlOccupancy, addPlanarCuboidApproximation;

}  // namespace planar_mapping::detail
