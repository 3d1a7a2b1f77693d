// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "planar_mapping/core/odometry/motion_estimation.h"

namespace planar_mapping::detail {

struct BundleSighting {
  std::size_t point = 0;
  FeatureSighting sighting;
};

struct BundleFrame {
  Pose T_sensor_world = Pose::Identity();
  bool fixed = false;
  std::optional<MotionPrior> prior;  ///< of T_sensor_world
  std::vector<BundleSighting> sightings;
};

/// What else is known of a point: of frames that are no longer there.
struct BundlePoint {
  Vector3 position = Vector3::Zero();
  Vector3 prior_position = Vector3::Zero();
  Matrix3 prior_information = Matrix3::Zero();
};

/// Corrects poses and points together so that the robust squared reprojection error is least:
/// Levenberg-Marquardt, points eliminated (Schur complement), dense Cholesky over the free poses.
/// O(sightings * frames + free frames^3) an iteration.
/// \return false if nothing could be improved
bool adjustBundle(const FeatureCamera& camera, double huber_sigmas, int iterations,
                  std::vector<BundleFrame>& frames, std::vector<BundlePoint>& points);

/// Squared Mahalanobis distance of a sighting of a point.
double sightingDistance(const FeatureCamera& camera, const Pose& T_sensor_world,
                        const Vector3& point, const FeatureSighting& sighting);

/// Information a sighting adds about a point (world frame), linearised at the point, and where it
/// would put it.
/// \return false where the point is not in front of the camera
bool sightingInformation(const FeatureCamera& camera, const Pose& T_sensor_world,
                         const Vector3& point, const FeatureSighting& sighting,
                         Matrix3& information, Vector3& position);

}  // namespace planar_mapping::detail
