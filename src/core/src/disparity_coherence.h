// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "disparity_cells.h"
#include "organized_coherence.h"

namespace planar_mapping::detail {

/// Tells planes from bent surfaces and from slices through unrelated objects, as coherentPlanes()
/// does in metres: the tiles of a plane must be filled with points whose neighbourhoods lie as the
/// plane does, and a quadratic surface must not explain them better.
/// \param parts ascending by tile
/// \return true per plane that is one
std::vector<char> coherentDisparities(const std::vector<DisparityPlane>& planes,
                                      const std::vector<TilePart>& parts, int columns, int tiles,
                                      const DisparityParams& params);

}  // namespace planar_mapping::detail
