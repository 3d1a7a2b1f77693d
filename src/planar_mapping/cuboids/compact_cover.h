// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/cuboids/cover/cover_effort.h"
#include "planar_mapping/cuboids/cuboid_approximation.h"
#include "planar_mapping/cuboids/raster/plane_raster.h"
#include "planar_mapping/geometry/cuboid.h"

namespace planar_mapping {

// [ours] Cuboids of the compact profile in two steps that a map repeats where it changed: large
// rectangles of each plane, then boxes for all that no rectangle covers. A cuboid covers what lies
// in it and what lies within absorption cells of it.

/// A rectangle of a plane in half cells: [a, a + width) x [b, b + height), each s / 2 wide.
using HalfCellRectangle = CellRectangle;

/// A quarter of a plane's cell that no rectangle covers, in half cells.
struct LooseQuarter {
  std::int32_t a = 0;
  std::int32_t b = 0;
  float probability = 1.0f;
};

/// What coverSurface() makes of one plane's cells.
struct SurfaceCover {
  std::vector<HalfCellRectangle> rectangles;
  std::vector<float> probability;   ///< of each rectangle: the mean over its cells
  std::vector<LooseQuarter> loose;  ///< for coverWithBoxes(), by (b, a)
};

/// Few rectangles for the cells of a plane; they may overlap, span holes of up to hole_size and
/// half a cell beyond the border, and leave half a cell to the tolerance. Parts that would need a
/// rectangle of their own of less than rectangle_cells are left loose. The paper's profile:
/// splitAndMerge(), and nothing is left.
/// \param cell_probability one value per cell of the mask, same layout
/// \throws ParameterError; InputError if the mask is not consistent
PLANAR_MAPPING_EXPORT SurfaceCover coverSurface(const CellMask& mask,
                                                const std::vector<float>& cell_probability,
                                                const CuboidApproximationParams& params);

/// The cuboid of a rectangle, which extends backwards by the thickness.
PLANAR_MAPPING_EXPORT Cuboid cuboidOf(const HalfCellRectangle& rectangle, const PlaneFrame& frame,
                                      const CuboidApproximationParams& params);

/// A piece of a surface, s / 4 wide.
struct SurfacePiece {
  Vector3 center = Vector3::Zero();
  float probability = 1.0f;
};

/// Adds the pieces of a quarter of a cell.
PLANAR_MAPPING_EXPORT void addPieces(const LooseQuarter& quarter, const PlaneFrame& frame,
                                     const CuboidApproximationParams& params,
                                     std::vector<SurfacePiece>& pieces);

/// An occupied cell of the axis-aligned grid, of points on no plane.
struct NonPlanarCell {
  std::int32_t x = 0;  ///< the cell spans [x s, (x + 1) s) and so on
  std::int32_t y = 0;
  std::int32_t z = 0;
  Vector3 mean = Vector3::Zero();  ///< of the points in it, metres
  float weight = 0.0f;             ///< number of points
  float probability = 1.0f;
  /// Which eighths of the cell hold points: bit 0, 1, 2 of the bit's number = upper half along x,
  /// y, z. Compact may leave a cell to a neighbour within half a cell of all its points. All of
  /// them (the default) where it is not known; none for a cell that needs no cuboid but may be part
  /// of one.
  std::uint8_t octants = 0xFF;
};

/// Cuboids of non-planar cells in the paper's profile: connected clusters, each split in the plane
/// fitted to it, leaves not merged.
/// \param cells  distinct, in any order
/// \param sensor leaves extend away from it
PLANAR_MAPPING_EXPORT std::vector<Cuboid> cuboidsOfCells(std::vector<NonPlanarCell> cells,
                                                         const CuboidApproximationParams& params,
                                                         const Vector3& sensor);

/// A rectangle's cuboid that boxes may replace, where that needs fewer cuboids.
struct ReplaceableCuboid {
  Cuboid cuboid;
  std::vector<SurfacePiece> pieces;  ///< of its plane that it covers
};

/// Which cuboids of a surface boxes may take the place of: those of up to 32 cells, and of up to
/// 128 beside a larger one, which keeps the surface a plane. What slants through the grid by more
/// than half a cell would become stairs of boxes, which reach into free space: of up to 8 cells
/// only. None without rectangle_cells.
/// \param cuboids of its rectangles, see cuboidOf()
/// \return one byte per cuboid, 1 if it may be replaced
PLANAR_MAPPING_EXPORT std::vector<std::uint8_t> replaceableOf(
    const std::vector<Cuboid>& cuboids, const CuboidApproximationParams& params);

/// What coverWithBoxes() makes.
struct BoxCover {
  std::vector<Cuboid> boxes;
  std::vector<std::uint8_t> kept;  ///< which of the replaceable cuboids are still needed
  bool is_clutter = false;         ///< too many boxes to search for fewer
};

/// Few axis-aligned boxes on the lattice of half cells for what no present cuboid covers, and the
/// choice between them and small rectangles of planes: never more cuboids than with all of the
/// rectangles, or with boxes alone.
/// \param cells   distinct ones of the axis-aligned grid of side s; one without octants needs no
///                box, one with less than min_points_per_cell is left out
/// \param pieces  of planes
/// \param present cuboids near them
/// \throws ParameterError
PLANAR_MAPPING_EXPORT BoxCover coverWithBoxes(const std::vector<NonPlanarCell>& cells,
                                              const std::vector<SurfacePiece>& pieces,
                                              const std::vector<Cuboid>& present,
                                              const std::vector<ReplaceableCuboid>& replaceable,
                                              const CuboidApproximationParams& params,
                                              CoverEffort effort = CoverEffort::Full);

/// Boxes in the place of some that coverWithBoxes() made in parts of a scene: for what these cover
/// and no present cuboid does. Those themselves where no fewer are found, or where cells and pieces
/// are so far apart that a box around them has more than 2^26 half cells.
/// \param cells, pieces  as above, near the boxes at least
PLANAR_MAPPING_EXPORT std::vector<Cuboid> coverAgain(const std::vector<Cuboid>& boxes,
                                                     const std::vector<NonPlanarCell>& cells,
                                                     const std::vector<SurfacePiece>& pieces,
                                                     const std::vector<Cuboid>& present,
                                                     const CuboidApproximationParams& params);

}  // namespace planar_mapping
