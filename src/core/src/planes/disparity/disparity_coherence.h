// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/disparity/disparity_cells.h"
#include "planes/organized/organized_coherence.h"

namespace planar_mapping::detail {

/// Parts of one plane: indices into the list of all parts, ascending by tile.
using PartList = std::vector<std::size_t>;
/// The parts of each plane.
std::vector<PartList> partsOfPlanes(const std::vector<TilePart>& parts, std::size_t planes);

/// What a quadratic surface through the means of the parts of a plane has over the plane; zero
/// where there are too few parts.
struct DisparityBend {
  double angle = 0.0;      ///< between both, root mean square, radians
  double advantage = 0.0;  ///< variance ratio (F)
  double bow = 0.0;        ///< root mean square, pixels
};
DisparityBend bendOf(const DisparityPlane& plane, const std::vector<TilePart>& parts,
                     const PartList& list, const DisparityParams& params);

/// Tells planes from bent surfaces and from slices through unrelated objects, as coherentPlanes()
/// does in metres: the tiles of a plane must be filled with points whose neighbourhoods lie as the
/// plane does, and a quadratic surface must not explain them better.
/// \param parts ascending by tile
/// \return true per plane that is one
std::vector<char> coherentDisparities(const std::vector<DisparityPlane>& planes,
                                      const std::vector<TilePart>& parts, int columns, int tiles,
                                      const DisparityParams& params);

}  // namespace planar_mapping::detail
