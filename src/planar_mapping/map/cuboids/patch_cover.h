// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/cuboids/compact_cover.h"
#include "planar_mapping/map/store/plane_layer.h"
#include "planar_mapping/map/store/surface_band.h"

namespace planar_mapping::detail {

/// What was derived from a patch of a plane.
struct PatchCover {
  struct Rectangle {
    HalfCellRectangle place;
    float probability = 1.0f;
    bool replaced = false;  ///< boxes of a region stand for it
  };
  // What it was derived from:
  std::int32_t plane = 0;            ///< its id
  std::uint64_t key = 0;             ///< of the patch
  std::uint32_t revision = 0;        ///< of the patch
  std::uint32_t frame_revision = 0;  ///< of the plane
  std::uint8_t spread = 0;           ///< surfaceSpread() of the plane

  std::vector<Rectangle> rectangles;
  std::vector<LooseQuarter> loose;
  std::vector<std::uint64_t> regions;  ///< in which it has or absorbs something; ascending

  std::size_t count() const;        ///< rectangles that are not replaced
  std::size_t memoryBytes() const;  ///< on the heap
};

/// Rectangles for the tiles of a patch.
SurfaceCover coverPatch(const std::vector<PlacedTile>& tiles,
                        const CuboidApproximationParams& params);

/// What a rectangle of the plane stands for: in the middle of the plane, or of a noisy one where
/// its band ends on both sides.
std::vector<SurfacePiece> piecesOf(const HalfCellRectangle& rectangle, const TileRaster& raster,
                                   const PlaneFrame& plane, const SurfaceBand& band,
                                   const CuboidApproximationParams& params);

}  // namespace planar_mapping::detail
