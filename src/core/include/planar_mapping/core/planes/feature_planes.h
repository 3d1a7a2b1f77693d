// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/geometry/key_feature.h"
#include "planar_mapping/core/planes/multi_plane.h"
#include "planar_mapping/core/base/types.h"

namespace planar_mapping {

/// Parameters of findPlanesFromFeatures().
struct PLANAR_MAPPING_EXPORT FeaturePlaneParams {
  /// Of the dense points: d_T, min_inliers, noise, patches; its method searches what features do
  /// not reach.
  MultiPlaneParams dense;
  int min_features = 8;  ///< [ours] features on a plane, fewer could be chance; >= 3
  /// [ours] Disparity errors a feature may lie off its plane where dense.noise is given; without,
  /// it is d_T. > 0
  double feature_error_factor = 1.5;
  /// [ours] Lets only points go with a plane that are a surface there (square_side ...
  /// min_surface_share), and refits it to them. Without, dense points only belong, as in the paper.
  bool refine = true;
  /// [ours] Looks for planes in the dense points that no plane of features claims (a plain wall has
  /// no features).
  bool dense_fallback = true;
  /// [ours] Side of the squares of a plane that are judged on their own, in units of d_T, > 0.
  double square_side = 4.0;
  /// [ours] A square is surface if it holds this many times the points of either slab beside it,
  /// >= 1: a plane through unrelated objects has as many beside it as on it.
  double square_dominance = 1.5;
  /// [ours] Share of a plane's points that must lie in such squares, in [0, 1].
  double min_surface_share = 0.5;
  /// [ours] Largest turn of a plane when it is refitted to its dense points, radians, in
  /// (0, pi/2]: one that turns farther stood on features of several surfaces.
  double max_refit_turn = 0.2;
  /// [ours] Radians up to which a plane of the dense search continues one of features, in
  /// [0, pi/2], if it also lies within d_T of it.
  double joining_angle = 0.1;

  /// \throws ParameterError
  void validate() const;
};

/// What findPlanesFromFeatures() did.
struct FeaturePlaneDiagnostics {
  std::size_t features_considered = 0;
  std::size_t features_not_finite = 0;
  std::size_t planes_of_features = 0;      ///< that multi-RANSAC proposed
  std::size_t rejected_not_surface = 0;    ///< their dense points lie beside them as well
  std::size_t rejected_turned = 0;         ///< by the refit
  std::size_t rejected_too_small = 0;      ///< fewer than min_inliers dense points
  std::size_t planes_joined = 0;           ///< of the dense search, continuing one of features
  std::size_t planes_of_dense_points = 0;  ///< in the result
  std::size_t points_of_features = 0;      ///< dense points on planes found by features
  std::size_t points_left = 0;             ///< that the dense search looked at
};

/// Planes of a frame from its key features first (the paper, III-C): multi-RANSAC on the features
/// proposes planes, dense points are clustered to them (Eq. 11, clusterByPlane()), and [ours] each
/// is kept where its dense points are a surface of their own, and refitted to them.
/// \param points   the dense cloud; non-finite points are skipped
/// \param indices  the points that count, or null for all
/// \param features positions in the frame of \p points; non-finite ones are skipped and counted
/// \param sensor   position of the sensor in the cloud's frame; orients normals
/// \return planes as findPlanes() returns them: inliers are dense points, largest plane first.
///         Without features: those of the dense search, or none without `dense_fallback`.
/// \throws ParameterError, InputError as findPlanes()
PLANAR_MAPPING_EXPORT PlaneSet findPlanesFromFeatures(
    const PointsView& points, const Indices* indices, const std::vector<KeyFeature>& features,
    const FeaturePlaneParams& params, const Vector3& sensor = Vector3::Zero(),
    FeaturePlaneDiagnostics* diagnostics = nullptr);

}  // namespace planar_mapping
