// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/core/cuboids/detail/compact_cover.h"
#include "store/plane_layer.h"
#include "store/surface_band.h"

namespace planar_mapping::detail {

/// Rectangles for the tiles of a patch.
SurfaceCover coverPatch(const std::vector<PlacedTile>& tiles,
                        const CuboidApproximationParams& params);

/// What a rectangle of the plane stands for: in the middle of the plane, or of a noisy one where
/// its band ends on both sides.
std::vector<SurfacePiece> piecesOf(const HalfCellRectangle& rectangle, const OpenRaster& raster,
                                   const PlaneFrame& plane, const SurfaceBand& band,
                                   const CuboidApproximationParams& params);

}  // namespace planar_mapping::detail
