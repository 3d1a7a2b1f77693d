// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/base/export.h"

namespace planar_mapping {

/// What solving changed.
struct PoseGraphResult {
  std::vector<std::int64_t> moved;  ///< ids of submaps whose T_world_submap changed
  double ms = 0.0;
};

/// Moves the submaps so that the links agree: poses of each component by least squares over its
/// links, robust against wrong ones; the first submap of a component stays. States, residuals and
/// components follow. The same data give the same bits.
PLANAR_MAPPING_EXPORT PoseGraphResult solvePoseGraph(AtlasData& data);

}  // namespace planar_mapping
