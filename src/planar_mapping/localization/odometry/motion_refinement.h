// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping::detail {

/// Nothing nearer to the camera than this is seen, metres.
constexpr double kNearestDepth = 1e-3;

/// Variances of what is seen now of a match.
Vector3 varianceOf(const FeatureMatch& match, const FeatureCamera& camera);

/// d(column, row, inverse depth) / d(point) at a point in the camera's frame.
Matrix3 projectionJacobian(const FeatureCamera& camera, const Vector3& point);

/// Inverse of a symmetric 3 x 3 matrix by cofactors of its scaled form.
/// \return false if it is not positive definite
bool invertCovariance(const Matrix3& covariance, Matrix3& inverse);

/// Squared Mahalanobis distance between what a motion predicts and what was seen; infinite where
/// there is no telling.
PLANAR_MAPPING_EXPORT double squaredError(const FeatureMatch& match, const FeatureCamera& camera,
                                          const Pose& T_now_before);

/// Normal equations of the inliers at the last iterate.
struct Refinement {
  Matrix6 information = Matrix6::Zero();
  double squared_error = 0.0;  ///< sum of squared Mahalanobis distances of the matches
};

/// Levenberg-Marquardt on the robust reprojection error of the matches \p used.
/// \return false if the normal equations are singular; \p motion is then what it was
bool refineMotion(const std::vector<FeatureMatch>& matches, const std::vector<std::uint8_t>& used,
                  const FeatureCamera& camera, int iterations, Pose& motion,
                  Refinement& refinement);

}  // namespace planar_mapping::detail
