// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "planar_mapping/planes/multi_plane.h"

// The searches behind findPlanes(), which checks parameters and indices before it calls them.
// Indices are then null or ascending without repetitions.
namespace planar_mapping::detail {

/// d_T(z) = max(d_T, k dz(z)), with dz = z^2 / (B f) dd written as one factor of z^2.
struct DistanceBand {
  double constant = 0.05;
  double per_square_depth = 0.0;

  explicit DistanceBand(const MultiPlaneParams& params) : constant(params.distance_threshold) {
    if (params.noise) per_square_depth = params.noise_factor * params.noise->depthError(1.0);
  }
  double at(double z) const { return std::max(constant, per_square_depth * z * z); }
};

/// \throws InputError for a view that contradicts itself or a sensor that is not finite
void checkView(const PointsView& points, const Vector3& sensor);
/// Checks the indices and returns them ascending without repetitions; \p storage holds the copy
/// if one is needed.
/// \throws InputError for one outside the cloud
const Indices* checkedIndices(const PointsView& points, const Indices& indices, Indices& storage);

PlaneSet findPlanesOrganized(const PointsView& points, const Indices* indices,
                             const MultiPlaneParams& params, const Vector3& sensor);
/// params.noise must be set; the sensor is at the origin and looks along z.
PlaneSet findPlanesDisparity(const PointsView& points, const Indices* indices,
                             const MultiPlaneParams& params);
PlaneSet findPlanesSequential(const PointsView& points, const Indices* indices,
                              const MultiPlaneParams& params, const Vector3& sensor);
PlaneSet findPlanesMultiRansac(const PointsView& points, const Indices* indices,
                               const MultiPlaneParams& params, const Vector3& sensor);

/// Whether the surfaces of a cloud fill the small cells of the sequential search with points.
bool isDense(const PointsView& points, const Indices* indices, const MultiPlaneParams& params);

enum class InlierRule : std::uint8_t {
  AsLabelled,       ///< every labelled point is an inlier, whatever its distance
  WithinThreshold,  ///< points farther than d_T(z) from the refitted plane are let go
};

/// Labels and planes to the result all searches share: inliers, moments, covariance, patches,
/// orientation towards the sensor, largest first. Planes below min_inliers are dropped.
/// \param labels plane per point of the cloud, -1 = none; only finite points may have one
PlaneSet assemblePlaneSet(const PointsView& points, const std::vector<std::int32_t>& labels,
                          const std::vector<Plane>& planes, const MultiPlaneParams& params,
                          const Vector3& sensor, InlierRule rule = InlierRule::AsLabelled);

/// clusterByPlane() for the points that count.
std::vector<std::int32_t> clusterIndexed(const PointsView& points, const Indices* indices,
                                         const std::vector<Plane>& planes,
                                         const MultiPlaneParams& params);

/// Largest first.
void sortBySize(std::vector<PlaneSegment>& planes);

/// Splits the inliers of a segment into connected patches on a bitmap in its plane and writes
/// segment.patches and segment.number_of_patches. Inliers within \p gap of each other are always
/// connected, inliers more than 2.2 gaps from all others of a patch never.
void findPatches(const PointsView& points, double gap, PlaneSegment& segment);

/// [ours] The gap when none is given: four thresholds, or four times the mean spacing of the
/// inliers where they are sparser than that.
double automaticPatchGap(const PlaneMoments::Fit& fit, double inliers, double distance_threshold);

}  // namespace planar_mapping::detail
