// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/base/types.h"
#include "planar_mapping/core/occupancy/occupancy.h"

namespace planar_mapping {

using Vector6 = Eigen::Matrix<double, 6, 1, Eigen::DontAlign>;
/// Covariance of a motion: translation x, y, z (metres), then rotation about x, y, z (radians),
/// both in the frame after the motion. The order of ROS's PoseWithCovariance.
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

/// Density of a normal distribution relative to its peak, exp(-1/2 e^T Sigma^-1 e): the factor
/// p(x_{t+k} | x_t) of Eq. 7 (the paper, Eq. 9).
/// [ours] "Relative to its peak" makes it a factor in [0, 1] whatever the units. A direction in
/// which Sigma vanishes allows no error: any error there makes the factor 0.
/// \param error       x - m, the state minus the predicted state
/// \param covariance  Sigma, symmetric, positive semi-definite
/// \return in [0, 1]
/// \throws ParameterError if anything is not finite or a variance is negative
PLANAR_MAPPING_EXPORT double motionFactor(const Vector3& error, const Matrix3& covariance);
PLANAR_MAPPING_EXPORT double motionFactor(const Vector6& error, const Matrix6& covariance);

/// Eq. 9 with x the robot's pose: how well the measured motion agrees with the predicted one.
/// \param covariance of the motion error
/// \throws as motionFactor()
PLANAR_MAPPING_EXPORT double poseMotionFactor(const Pose& measured, const Pose& predicted,
                                              const Matrix6& covariance);

/// Eq. 9 with x the feature's position, carried over by R, T. Sigma is the covariance of the
/// motion at the point plus the measurement covariances of both sightings.
/// \param now     where the feature is seen, relative to the sensor, metres
/// \param before  where it was seen, relative to the sensor then, metres
/// \param T_now_before       the motion: coordinates then to coordinates now
/// \param motion_covariance  of T_now_before
/// \throws as motionFactor()
PLANAR_MAPPING_EXPORT double featureMotionFactor(const Vector3& now, const Vector3& before,
                                                 const Pose& T_now_before,
                                                 const Matrix6& motion_covariance,
                                                 const OccupancyParams& params);

/// [ours] Covariance of a feature's position: the depth error stretched along the ray (r / z * dz)
/// and dd pixels across it (r / f * dd); square metres.
PLANAR_MAPPING_EXPORT Matrix3 measurementCovariance(const Vector3& point,
                                                    const OccupancyParams& params);

}  // namespace planar_mapping
