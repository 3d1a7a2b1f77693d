// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/core/cuboid_approximation.h"

namespace planar_mapping::detail {

/// Cells of one plane that lie together, with the mean belief of each.
struct PlanePatch {
  PlaneFrame frame;  ///< of this patch: cell (0, 0) starts at its origin
  CellMask mask;
  std::vector<float> probability;  ///< empty = 1 everywhere
};

/// Puts the inliers of a plane into cells: one pass over the points.
///
/// The raster starts at the corner of the inliers' bounding rectangle. Patches far apart get
/// rasters of their own, so that memory follows the number of points and not the extent.
/// \param points_dropped increased by the points in cells with too few of them
std::vector<PlanePatch> rasterizePlane(const PointsView& points, const Plane& plane,
                                       const Indices& inliers,
                                       const CuboidApproximationParams& params,
                                       const Vector3& sensor,
                                       const std::vector<float>* point_probability,
                                       std::size_t& points_dropped);

}  // namespace planar_mapping::detail
