// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/tiles/plane_fit.h"

namespace planar_mapping::detail {

/// Tells planes from bent surfaces and from slices through unrelated objects: the tiles of a plane
/// must be filled with points whose neighbourhoods lie as the plane does, and a quadratic surface
/// must not explain them better.
/// \param parts ascending by tile
/// \return true per plane that is one
std::vector<char> coherentPlanes(const std::vector<PlaneCandidate>& planes,
                                 const std::vector<TilePart>& parts, int columns, int tiles,
                                 const PlaneFit& fit);

/// Fits a quadratic surface to the means of the parts; zero where they are too few.
/// \param axes of the places of the parts
Bend bendOf(const PlaneCandidate& plane, const std::vector<TilePart>& parts, const PartList& list,
            const Vector3 (&axes)[2]);

}  // namespace planar_mapping::detail
