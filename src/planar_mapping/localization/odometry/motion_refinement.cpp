// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/odometry/motion_refinement.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "planar_mapping/geometry/angles.h"

namespace planar_mapping::detail {
namespace {

Vector3 sightingError(const FeatureMatch& match, const FeatureCamera& camera,
                      const Vector3& point) {
  const FeatureSighting predicted = project(camera, point);
  return {match.now.column - predicted.column, match.now.row - predicted.row,
          match.now.inverse_depth - predicted.inverse_depth};
}

/// From so many standard deviations on an error counts linearly.
constexpr double kHuberSigmas = 1.5;

/// Weight of an error of so many standard deviations, and its fraction of the cost.
double huberWeight(double squared) {
  return squared <= kHuberSigmas * kHuberSigmas ? 1.0 : kHuberSigmas / std::sqrt(squared);
}
double huberCost(double squared) {
  return squared <= kHuberSigmas * kHuberSigmas
             ? squared
             : kHuberSigmas * (2.0 * std::sqrt(squared) - kHuberSigmas);
}

struct NormalEquations {
  Matrix6 hessian = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double cost = 0.0;
  double squared_error = 0.0;
};

void addMatch(const FeatureMatch& match, const FeatureCamera& camera, const Pose& motion,
              NormalEquations& sum) {
  const Vector3 p = motion * match.before;
  if (!(p.z() > kNearestDepth)) return;
  const Matrix3 at_point = projectionJacobian(camera, p);
  const Matrix3 at_before = at_point * motion.linear();
  Matrix3 covariance = at_before * match.covariance * at_before.transpose();
  covariance.diagonal() += varianceOf(match, camera);
  Matrix3 information;
  if (!invertCovariance(covariance, information)) return;
  const Vector3 error = sightingError(match, camera, p);
  const double squared = error.dot(information * error);
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << at_point, at_point * crossMatrix(-p);
  const Matrix3 weighted = huberWeight(squared) * information;
  sum.hessian.noalias() += jacobian.transpose() * (weighted * jacobian);
  sum.gradient.noalias() += jacobian.transpose() * (weighted * error);
  sum.cost += huberCost(squared);
  sum.squared_error += squared;
}

NormalEquations normalEquations(const std::vector<FeatureMatch>& matches,
                                const std::vector<std::uint8_t>& used, const FeatureCamera& camera,
                                const Pose& motion) {
  NormalEquations sum;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (used[i] != 0) addMatch(matches[i], camera, motion, sum);
  }
  return sum;
}

}  // namespace

Vector3 varianceOf(const FeatureMatch& match, const FeatureCamera& camera) {
  return match.now_variance.isZero() ? sightingVariance(camera, match.now.inverse_depth)
                                     : match.now_variance;
}

Matrix3 projectionJacobian(const FeatureCamera& camera, const Vector3& point) {
  const double w = 1.0 / point.z();
  Matrix3 jacobian;
  jacobian << camera.fx * w, 0.0, -camera.fx * point.x() * w * w,  //
      0.0, camera.fy * w, -camera.fy * point.y() * w * w,          //
      0.0, 0.0, -w * w;
  return jacobian;
}

bool invertCovariance(const Matrix3& covariance, Matrix3& inverse) {
  // Pixels and inverse depth differ by orders of magnitude: to unit diagonal first.
  const Vector3 variance = covariance.diagonal();
  if (!(variance.minCoeff() > 0.0) || !covariance.allFinite()) return false;
  const Vector3 scale = variance.cwiseSqrt().cwiseInverse();
  const Matrix3 correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  const double determinant = correlation.determinant();
  if (!(determinant > 1e-12)) return false;
  inverse = scale.asDiagonal() * correlation.inverse() * scale.asDiagonal();
  return true;
}

double squaredError(const FeatureMatch& match, const FeatureCamera& camera,
                    const Pose& T_now_before) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const Vector3 p = T_now_before * match.before;
  if (!(p.z() > kNearestDepth)) return kNever;
  const Vector3 error = sightingError(match, camera, p);
  const Matrix3 at_before = projectionJacobian(camera, p) * T_now_before.linear();
  Matrix3 covariance = at_before * match.covariance * at_before.transpose();
  // A point beside the camera may be anywhere in the image, which a linear covariance takes for
  // agreement with all. Three standard deviations = 45 degrees.
  constexpr double kMaxDirectionError = 1.0 / 3.0;  // tangent
  if (covariance(0, 0) > std::pow(kMaxDirectionError * camera.fx, 2) ||
      covariance(1, 1) > std::pow(kMaxDirectionError * camera.fy, 2)) {
    return kNever;
  }
  covariance.diagonal() += varianceOf(match, camera);
  Matrix3 information;
  if (!invertCovariance(covariance, information)) return kNever;
  const double squared = error.dot(information * error);
  return squared >= 0.0 ? squared : kNever;
}

bool refineMotion(const std::vector<FeatureMatch>& matches, const std::vector<std::uint8_t>& used,
                  const FeatureCamera& camera, int iterations, Pose& motion,
                  Refinement& refinement) {
  constexpr double kConverged = 1e-10;
  NormalEquations now = normalEquations(matches, used, camera, motion);
  double damping = 1e-6;
  for (int i = 0; i < iterations; ++i) {
    Matrix6 damped = now.hessian;
    damped.diagonal() *= 1.0 + damping;
    const Eigen::LDLT<Matrix6> solver(damped);
    const Vector6 pivots = solver.vectorD();
    if (!(pivots.minCoeff() > 1e-15 * pivots.maxCoeff())) return false;
    const Vector6 step = solver.solve(now.gradient);
    if (!step.allFinite()) return false;
    const Pose candidate = motionStep(step) * motion;
    NormalEquations next = normalEquations(matches, used, camera, candidate);
    if (next.cost <= now.cost) {
      motion = candidate;
      now = next;
      damping = std::max(1e-9, 0.1 * damping);
      if (step.squaredNorm() < kConverged * kConverged) break;
    } else {
      damping = std::max(1e-3, 10.0 * damping);
      if (damping > 1e6) break;
    }
  }
  // Products of rotations drift away from being one.
  motion.linear() = Eigen::Quaterniond(Matrix3(motion.linear())).normalized().toRotationMatrix();
  refinement = {now.hessian, now.squared_error};
  return true;
}

}  // namespace planar_mapping::detail
