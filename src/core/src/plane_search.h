// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/multi_plane.h"

// The searches behind findPlanes(), which checks parameters and indices before it calls them.
namespace planar_mapping::detail {

PlaneSet findPlanesOrganized(const PointsView& points, const Indices* indices,
                             const MultiPlaneParams& params, const Vector3& sensor);
PlaneSet findPlanesSequential(const PointsView& points, const Indices* indices,
                              const MultiPlaneParams& params, const Vector3& sensor);
PlaneSet findPlanesMultiRansac(const PointsView& points, const Indices* indices,
                               const MultiPlaneParams& params, const Vector3& sensor);

/// Labels and planes to the result all searches share: inliers, moments, covariance, patches,
/// orientation towards the sensor, largest first. Planes below min_inliers are dropped.
/// \param labels plane per point of the cloud, -1 = none
PlaneSet assemblePlaneSet(const PointsView& points, const std::vector<std::int32_t>& labels,
                          const std::vector<Plane>& planes, const MultiPlaneParams& params,
                          const Vector3& sensor);

}  // namespace planar_mapping::detail
