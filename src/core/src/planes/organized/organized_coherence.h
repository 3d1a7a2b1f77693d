// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/organized/organized_growing.h"

namespace planar_mapping::detail {

/// The pixels of one plane in one tile.
struct TilePart {
  std::int32_t tile = 0;
  std::int16_t label = -1;
  std::int16_t finite = 0;  ///< finite pixels of the tile, of this plane or not
  MomentSums sums = {};
};

/// Tells planes from bent surfaces and from slices through unrelated objects.
///
/// Only planes whose residual is not small beside their width are in doubt. They must fill the
/// tiles they cross with points whose neighbourhoods lie as the plane does, and a quadratic surface
/// must not explain them better than the plane.
/// \param parts ascending by tile
/// \return true per plane that is one
std::vector<char> coherentPlanes(const std::vector<PlaneCandidate>& planes,
                                 const std::vector<TilePart>& parts, int columns, int tiles,
                                 const RangeNoise& noise, const Vector3& sensor,
                                 const OrganizedParams& params);

/// Refits a plane to the parts along the rays of the sensor: least squares of 1 / r, weighted by
/// the noise, of directions that are exact. Unlike the fit across the plane it is not biased by
/// noise along oblique rays, and far points weigh less. Keeps the plane where the rays graze it.
void fitAlongRays(PlaneCandidate& plane, const std::vector<TilePart>& parts,
                  const std::vector<std::size_t>& list, const RangeNoise& noise,
                  const Vector3& sensor, const OrganizedParams& params);

}  // namespace planar_mapping::detail
