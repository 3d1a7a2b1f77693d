// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping {

/// Parameters of the occupancy probability of a feature (the paper, III-D).
struct PLANAR_MAPPING_EXPORT OccupancyParams {
  StereoNoise noise;  ///< B, f and the disparity error dd = 0.5 px
  double eta1 = 1.0;  ///< eta1 of Eq. 4, the belief at the peak, in (0, 1]
  /// [ours] Belief in a group of one, which has no mean range of others, in [0, 1].
  double single_feature_probability = 0.5;
  /// [ours] Lower bound of dr, metres, >= 0; 0 = the paper. A cell of side s holds ranges up to
  /// s * sqrt(3) apart however small the noise, and near the camera Eq. 4 would doubt all of them.
  double min_range_error = 0.0;
  /// [ours] Direction in which depth z is measured, from the sensor; zero = depth is the range
  /// (laser scanners). Need not have unit length.
  Vector3 optical_axis = Vector3::UnitZ();

  /// \throws ParameterError
  void validate() const;
};

/// Depth z of a point relative to the sensor, metres, >= 0 (see OccupancyParams::optical_axis).
PLANAR_MAPPING_EXPORT double depthOf(const Vector3& point, const Vector3& optical_axis);

/// Range error dr = (rbar / z) * dz, metres (the paper, III-D).
/// \param mean_range  rbar, mean range of the group, metres, >= 0
/// \param depth       z of the feature, metres, >= 0
/// \throws ParameterError if an argument is NaN, infinite or negative
PLANAR_MAPPING_EXPORT double rangeError(double mean_range, double depth, const StereoNoise& noise);

/// Occupancy probability of a feature, eta1 * exp(-1/2 ((r - rbar) / dr)^2) (the paper, Eq. 4).
/// \param range        r, Euclidean range of the feature, metres
/// \param mean_range   rbar, metres
/// \param range_error  dr, metres, >= 0; where it is 0, only r = rbar has a belief above 0
/// \return in [0, eta1]
/// \throws ParameterError if an argument is NaN or out of range
PLANAR_MAPPING_EXPORT double featureProbability(double range, double mean_range, double range_error,
                                                double eta1 = 1.0);

/// Eq. 4 for many features at once; O(n log n).
/// \param points  the features, relative to the sensor, metres
/// \param indices the features that count, or null for all
/// \param groups  group of each feature of \p indices, in its order (the features in one grid cell
///                of one plane); any values, negative = a group of its own
/// \return one belief per feature of \p indices, in its order; 0 for a non-finite one, which does
///         not count in its group either
/// \throws ParameterError; InputError for an index outside the cloud or sizes that disagree
PLANAR_MAPPING_EXPORT std::vector<float> featureProbabilities(
    const PointsView& points, const Indices* indices, const std::vector<std::int32_t>& groups,
    const OccupancyParams& params);

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

/// Constants of the update of a belief (the paper, III-E).
struct PLANAR_MAPPING_EXPORT KlUpdateParams {
  double eta2 = 1.0;   ///< normalisation of Eq. 7, in (0, 1]
  double eta3 = 1.0;   ///< normalisation of Eq. 10, in (0, 1]
  double bias = 1.07;  ///< A of Eq. 10, dimensionless, >= 0; larger doubts weak evidence more
  /// [ours] Beliefs are kept this far from 0 and 1 before the logarithm, in (0, 0.5).
  double clamp = 1e-6;

  /// \throws ParameterError
  void validate() const;
};

/// q = eta2 * p_{t+k} * p(x_{t+k} | x_t), the belief that the new sighting alone gives
/// (the paper, Eq. 7).
/// \param probability    p_{t+k}, the feature's probability in the new frame (Eq. 4), in [0, 1]
/// \param motion_factor  p(x_{t+k} | x_t) relative to its peak (Eq. 9), in [0, 1]
/// \throws ParameterError if an argument is NaN or out of range
PLANAR_MAPPING_EXPORT double observedBelief(double probability, double motion_factor,
                                            const KlUpdateParams& params = KlUpdateParams());

/// D = p log(p / q), natural logarithm: one term of the sum (the paper, Eq. 5, 6).
/// \param before   p, belief from the earlier frame, in [0, 1]
/// \param observed q, belief the new sighting gives, in [0, 1]
/// \note [ours] both are clamped to [clamp, 1 - clamp] first
/// \throws ParameterError if an argument is NaN or out of range
PLANAR_MAPPING_EXPORT double klDivergence(double before, double observed,
                                          const KlUpdateParams& params = KlUpdateParams());

/// Belief in a feature after it was seen again, eta3 * exp(-E) with E = |D| + A if both p <= 0.5
/// and q <= 0.5, else |D| (the paper, Eq. 10).
/// \param before   p, belief from the earlier frame, in [0, 1]
/// \param observed q, see observedBelief(), in [0, 1]
/// \return belief in [0, 1]
/// \throws ParameterError if an argument is NaN or out of range
PLANAR_MAPPING_EXPORT double updatedBelief(double before, double observed,
                                           const KlUpdateParams& params = KlUpdateParams());

}  // namespace planar_mapping
