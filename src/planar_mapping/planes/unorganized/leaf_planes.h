// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/planes/multi_plane.h"
#include "planar_mapping/planes/surface_leaves.h"

namespace planar_mapping::detail {

/// A plane and the leaves whose position and normal agree with it.
struct LeafPlane {
  Plane plane;
  std::vector<std::int32_t> support;  ///< leaves, ascending
};

/// Planes of the leaves, one after the other, the one with most points first: blocks of leaves
/// propose planes, all leaves vote, the winner is refitted to its voters until they stay the same.
std::vector<LeafPlane> findLeafPlanes(const SurfaceLeaves& surface, const MultiPlaneParams& params,
                                      PlaneSearchDiagnostics& diagnostics);

}  // namespace planar_mapping::detail
