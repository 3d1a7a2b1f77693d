// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/core/planes/multi_plane.h"

namespace planar_mapping::detail {

/// Cuts each plane into squares and frees the points of squares that lie on no surface: where the
/// slabs of the same thickness on either side hold nearly as many points as the plane. A plane
/// loses all points if most of them lie in such squares.
/// \param indices the points that count
/// \param labels  plane per point of the cloud, -1 = none
/// \return planes that lost all points
std::size_t keepSurfaces(const PointsView& points, const Indices& indices,
                         const std::vector<Plane>& planes, const MultiPlaneParams& params,
                         std::vector<std::int32_t>& labels);

}  // namespace planar_mapping::detail
