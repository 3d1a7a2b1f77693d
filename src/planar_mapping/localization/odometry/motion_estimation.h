// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/beliefs/occupancy.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping {

/// A feature seen now whose place is known in the frame before (or in a map).
struct FeatureMatch {
  Vector3 before = Vector3::Zero();      ///< frame before, metres
  Matrix3 covariance = Matrix3::Zero();  ///< of before, square metres
  FeatureSighting now;
  /// Variances of column, row (px^2) and inverse depth (1/m^2) of now; zero = those of the camera,
  /// see sightingVariance().
  Vector3 now_variance = Vector3::Zero();
};

/// Parameters of estimateMotion(); all [ours], the paper (Eq. 8) only says RANSAC.
struct PLANAR_MAPPING_EXPORT MotionParams {
  /// A match agrees with a motion where its error in column, row and inverse depth is within so
  /// many standard deviations of the noise of both sightings; > 0. 3.37 = 99 % of a normal error.
  double inlier_sigmas = 3.37;
  int min_matches = 8;       ///< fewer: no attempt is made, >= 3
  int min_inliers = 10;      ///< fewer: the motion is not believed, >= 3
  int max_iterations = 500;  ///< minimal sets tried at most, >= 1
  /// A motion with a larger standard deviation in any direction is not believed; > 0.
  double max_translation_error = 0.3;       ///< metres
  double max_rotation_error = M_PI / 60.0;  ///< radians

  /// Whether a covariance is within these two errors.
  bool isCertain(const Matrix6& covariance) const;
  /// \throws ParameterError
  void validate() const;
};

enum class MotionStatus : std::uint8_t {
  Found,
  TooFewMatches,  ///< see MotionParams::min_matches
  TooFewInliers,  ///< no motion that enough matches agree with: wrong matches or moving things
  Uncertain,      ///< the inliers do not fix all six parameters, e.g. they are on a line
};

struct MotionEstimate {
  MotionStatus status = MotionStatus::TooFewMatches;
  Pose T_now_before = Pose::Identity();  ///< R, T of Eq. 8; identity unless Found
  /// Of T_now_before: inverse of the inliers' normal equations, times their mean squared error
  /// where that is above the noise model's; see Matrix6.
  Matrix6 covariance = Matrix6::Zero();
  std::vector<std::uint8_t> is_inlier;  ///< one per match
  std::size_t inliers = 0;

  bool found() const { return status == MotionStatus::Found; }
};

/// Motion of a camera between two frames from matched features (the paper, Eq. 8): RANSAC over
/// minimal sets of three, then a robust refit of the reprojection error over the inliers.
/// Deterministic for equal arguments and state of \p random; O(matches * iterations).
/// \param matches  non-finite ones and points behind the camera never agree with any motion
/// \param guess    tried as the first hypothesis, e.g. constant velocity; it costs nothing if wrong
/// \throws ParameterError
PLANAR_MAPPING_EXPORT MotionEstimate estimateMotion(const std::vector<FeatureMatch>& matches,
                                                    const FeatureCamera& camera,
                                                    const MotionParams& params, Random& random,
                                                    const Pose* guess = nullptr);

/// The rigid motion with least squared distance |T p_i - q_i| (Kabsch, Umeyama without scale).
/// \return false for fewer than three points, sizes that disagree, non-finite or collinear points;
///         \p motion is then untouched
PLANAR_MAPPING_EXPORT bool rigidMotion(const std::vector<Vector3>& p, const std::vector<Vector3>& q,
                                       Pose& motion);

/// exp of (translation, rotation): T = [exp(r) | t], so that T' = motionStep(xi) * T is T after the
/// small error xi in the order of Matrix6.
PLANAR_MAPPING_EXPORT Pose motionStep(const Vector6& step);
/// The xi with motionStep(xi) * from = to.
PLANAR_MAPPING_EXPORT Vector6 motionDifference(const Pose& from, const Pose& to);
/// Ad(T): motionStep(adjoint(T) * xi) * T = T * motionStep(xi) to first order.
PLANAR_MAPPING_EXPORT Matrix6 adjoint(const Pose& T);
/// Covariance of adjoint(T) * xi, where that of xi is given; symmetric to the last bit.
PLANAR_MAPPING_EXPORT Matrix6 turnedCovariance(const Pose& T, const Matrix6& covariance);

}  // namespace planar_mapping
