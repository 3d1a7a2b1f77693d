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

/// [ours] Side of the smallest cell for a cloud of this size and density, metres: a hundredth of
/// the extent, at least four point spacings, rounded to 1, 2 or 5 times a power of ten.
}  // namespace planar_mapping::detail
