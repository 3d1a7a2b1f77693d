// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/core/registration/detail/surface_map.h"

namespace planar_mapping::detail {

/// Points of an organized cloud where a surface ends in front of something farther away: the edges
/// of a box stay where they are while it is walked around. Empty for clouds without rows.
std::vector<Vector3> occludingEdges(const PointsView& cloud, const SurfaceMapParams& params);

}  // namespace planar_mapping::detail
