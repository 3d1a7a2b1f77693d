// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/pipeline/stage_table.h"

// Each group of stages adds itself; registerBuiltinStages() calls these in the order of a chain.
namespace planar_mapping::detail {

void addStereoMatching(StageTable& table);
void addKeyFeatures(StageTable& table);
void addPclFilters(StageTable& table);
void addDepthErrorLimit(StageTable& table);
void addMotionEstimation(StageTable& table);
void addGroundRemoval(StageTable& table);
void addMultiPlaneSegmentation(StageTable& table);
void addKlOccupancy(StageTable& table);
void addPlanarCuboidApproximation(StageTable& table);

}  // namespace planar_mapping::detail
