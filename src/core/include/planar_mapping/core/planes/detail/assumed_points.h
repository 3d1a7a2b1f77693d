// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/base/types.h"
#include "planar_mapping/core/geometry/camera.h"
#include "planar_mapping/core/planes/multi_plane.h"

namespace planar_mapping {

/// [ours] Points of planes where nothing was measured: a wall of one colour between its edges, base
/// board and pictures. They are no measurements and clear no space.
struct AssumedPoints {
  std::vector<float> xyz;         ///< three a point, metres, frame of the cloud
  std::vector<Indices> of_plane;  ///< for each plane, the numbers of its points
  double probability = 0.6;       ///< belief in each of them, in [0, 1]

  bool empty() const { return xyz.empty(); }
};

constexpr int kEvenTileSide = 4;  ///< pixels

/// Where an image is even, in tiles of kEvenTileSide pixels, row by row: bit 0 if gray values of a
/// tile differ by no more than the noise of the camera, bits 1 to 4 if there is a step to the tile
/// to the right, below to the right, below, and below to the left.
/// \param gray  row by row without padding
PLANAR_MAPPING_EXPORT std::vector<std::uint8_t> evenTiles(const std::uint8_t* gray, int width,
                                                          int height);

/// Points for the pixels of even tiles of which none is measured, where a plane is what is measured
/// or assumed at the end of the even tiles in two of eight directions 135 degrees or more apart,
/// and in more of them than all other planes. The way ends at a step.
/// \param cloud   organized, of the camera; NaN where nothing is measured
/// \param even    of the image of the same pixels, see evenTiles()
/// \param planes  of the cloud
/// \throws InputError if the cloud is not organized, or sizes disagree
PLANAR_MAPPING_EXPORT AssumedPoints assumePoints(const PointsView& cloud,
                                                 const PinholeCamera& camera,
                                                 const std::vector<std::uint8_t>& even,
                                                 const std::vector<PlaneSegment>& planes);

}  // namespace planar_mapping
