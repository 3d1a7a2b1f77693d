// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/core/cuboids/cuboid_approximation.h"

namespace planar_mapping::detail {

/// Cells of one plane that lie together, with the mean belief of each.
struct PlanePatch {
  PlaneFrame frame;  ///< of this patch: cell (0, 0) starts at its origin
  CellMask mask;
  /// Which quarters of a cell hold points: bit 0 low u and low v, 1 high u, 2 high v, 3 both high.
  std::vector<std::uint8_t> quarters;
  std::vector<float> probability;  ///< empty = 1 everywhere
};

/// The points of one plane on the way into cells.
struct PlanePoints {
  const PointsView& points;
  const Indices& inliers;
  const std::vector<float>* probability;  ///< per point of the cloud, or null = 1
};

/// Puts the inliers of a plane into cells of params.resolution.
///
/// The raster has as few columns and rows as the inliers' bounding rectangle in \p frame needs; the
/// slack is shared by both sides. Patches far apart get rasters of their own, so that memory
/// follows the number of points and not the extent.
/// \param points_dropped increased by what is not finite or in a cell with too few points
std::vector<PlanePatch> rasterizePlane(const PlanePoints& input, const PlaneFrame& frame,
                                       const CuboidApproximationParams& params,
                                       std::size_t& points_dropped);

/// The same for points spread too far for one raster; used by rasterizePlane().
std::vector<PlanePatch> rasterizeSparsely(const PlanePoints& input, const PlaneFrame& frame,
                                          const CuboidApproximationParams& params,
                                          std::size_t& points_dropped);

/// Number of cells that an extent needs; a hair more than a whole number does not cost one more.
double cellsAcross(double extent, double resolution);

}  // namespace planar_mapping::detail
