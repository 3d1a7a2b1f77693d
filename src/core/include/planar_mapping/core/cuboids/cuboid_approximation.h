// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/core/geometry/cuboid.h"
#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/planes/multi_plane.h"
#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"

namespace planar_mapping {

enum class Profile : std::uint8_t {
  Paper,    ///< nothing beyond the paper
  Compact,  ///< [ours] fewest rectangles, absorption, merging of what is left
};

/// Parameters of approximateCuboids() and of the map. Lengths in metres.
struct PLANAR_MAPPING_EXPORT CuboidApproximationParams {
  Profile profile = Profile::Compact;
  double resolution = 0.1;         ///< s, side of the smallest cell, > 0
  double thickness = 0.0;          ///< extension along -n; 0 = resolution
  double density_threshold = 0.9;  ///< D_T of the split, in (0, 1]
  double min_width = 0.0;          ///< W_T; 0 = resolution
  double min_height = 0.0;         ///< H_T; 0 = resolution
  int min_points_per_cell = 1;     ///< cells with fewer points are empty, >= 1
  /// [ours] compact: holes of a patch up to this side are filled; 0 = resolution, less = off
  double hole_size = 0.0;
  /// [ours] compact: points within this many cells of a cuboid need none of their own, in [0, 0.5]
  double absorption = 0.5;
  /// [ours] compact: a plane's rectangle of fewer cells of its own is left to the boxes, >= 0
  double rectangle_cells = 4.0;
  Vector3 up = Vector3::UnitZ();  ///< vertical of the cloud's frame, for "horizontal" u
  int threads = 1;

  /// \throws ParameterError
  void validate() const;
};

struct CuboidApproximationDiagnostics {
  std::size_t planar_points = 0;
  std::size_t non_planar_points = 0;
  std::size_t absorbed_points = 0;  ///< non-planar points already inside a planar cuboid
  std::size_t dropped_points = 0;   ///< in cells with too few points, or not finite
  std::size_t planar_cuboids = 0;
  std::size_t non_planar_cuboids = 0;
  std::size_t standard_cells = 0;  ///< A_S: occupied cells of a standard grid over the same points
};

/// Planar and non-planar points to oriented cuboids (the paper, III-F, Fig. 6-8).
/// \param points  the cloud
/// \param indices the points that count, or null for all
/// \param planes  planes with their inliers (disjoint, into the cloud); what is in none of them is
///                the non-planar part
/// \param sensor  position of the sensor; cuboids extend away from it
/// \param point_probability belief per point of the cloud, or null (then 1)
/// \return planar cuboids plane by plane, then the non-planar ones
PLANAR_MAPPING_EXPORT std::vector<Cuboid> approximateCuboids(
    const PointsView& points, const Indices* indices, const std::vector<PlaneSegment>& planes,
    const CuboidApproximationParams& params, const Vector3& sensor = Vector3::Zero(),
    const std::vector<float>* point_probability = nullptr,
    CuboidApproximationDiagnostics* diagnostics = nullptr);

/// Cuboids of one plane's occupied cells, in the frame that \p frame is given in. Each rectangle is
/// extended backwards (along -n) by the thickness.
/// \param cell_probability one value per cell of the mask, same layout; empty = 1 everywhere. A
///                         cuboid gets the mean over its cells.
PLANAR_MAPPING_EXPORT std::vector<Cuboid> cuboidsOfPlane(const PlaneFrame& frame,
                                                         const CellMask& mask,
                                                         const std::vector<float>& cell_probability,
                                                         std::int32_t plane_id,
                                                         const CuboidApproximationParams& params);

/// An occupied cell of the axis-aligned grid that holds what lies on no plane.
struct NonPlanarCell {
  std::int32_t x = 0;  ///< the cell spans [x s, (x + 1) s) and so on
  std::int32_t y = 0;
  std::int32_t z = 0;
  Vector3 mean = Vector3::Zero();  ///< of the points in it, metres
  float weight = 0.0f;             ///< number of points
  float probability = 1.0f;
  /// Which eighths of the cell hold points: bit 0, 1, 2 of the bit's number = upper half along x,
  /// y, z. [ours] Compact may leave a cell to a neighbour that is within half a cell of all its
  /// points. All of them (the default) where it is not known; none for a cell that needs no cuboid
  /// but may be part of one.
  std::uint8_t octants = 0xFF;
};

/// Cuboids of the non-planar part. Paper: connected clusters, each split in the plane fitted to it,
/// leaves not merged. Compact: cells merged to few axis-aligned boxes.
/// \param sensor leaves extend away from it
PLANAR_MAPPING_EXPORT std::vector<Cuboid> cuboidsOfCells(const std::vector<NonPlanarCell>& cells,
                                                         const CuboidApproximationParams& params,
                                                         const Vector3& sensor);

}  // namespace planar_mapping
