// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/planes/multi_plane.h"

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

/// Measured points of even tiles next to even ones without any, ascending. They are no
/// measurements: matching carries the depth of an edge half a window on into what is even.
/// \param cloud  organized, of the camera; NaN where nothing is measured
/// \param even   of the image of the same pixels, see evenTiles()
/// \throws InputError if the cloud is not organized, or sizes disagree
PLANAR_MAPPING_EXPORT Indices carriedPoints(const PointsView& cloud, const PinholeCamera& camera,
                                            const std::vector<std::uint8_t>& even);

/// Points for the pixels of holes: even tiles, none measured, without a step between them. A plane
/// continues in a hole if at least eight measured tiles around it lie on it and next to none behind
/// it; one that is not upright only where nearly all of these tiles lie on it, since what stands on
/// a floor hides it. Where no plane of the frame is seen so, one is looked for in these tiles
/// alone: pictures and base boards are often too small for the search for planes. A plane continues
/// within the rectangle around those of these tiles that lie on it; of several planes the nearest
/// counts. Nothing is assumed where its error exceeds params.distance_threshold, nor behind the
/// ground, nor behind another plane turned otherwise in the columns from the first to the last that
/// shows it.
/// \param cloud    organized, of the camera; NaN where nothing is measured
/// \param indices  points that may belong to planes
/// \param ground   points of the ground, which are not among them
/// \param even     of the image of the same pixels, see evenTiles()
/// \param planes   of the cloud; planes that are found here are added, and take over those that are
///                 parts of them
/// \throws InputError if the cloud is not organized, or sizes disagree
PLANAR_MAPPING_EXPORT AssumedPoints assumePoints(const PointsView& cloud, const Indices& indices,
                                                 const Indices& ground, const PinholeCamera& camera,
                                                 const std::vector<std::uint8_t>& even,
                                                 const Vector3& up, const MultiPlaneParams& params,
                                                 std::vector<PlaneSegment>& planes);

}  // namespace planar_mapping
