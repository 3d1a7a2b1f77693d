// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/occupancy.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

template <int N>
double relativeDensity(const Eigen::Matrix<double, N, 1>& error,
                       const Eigen::Matrix<double, N, N>& covariance) {
  if (!error.allFinite()) throw ParameterError("motion error", error.sum(), "finite");
  if (!covariance.allFinite())
    throw ParameterError("motion covariance", covariance.sum(), "finite");
  const Eigen::Matrix<double, N, N> symmetric = 0.5 * (covariance + covariance.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(symmetric);
  const auto& variance = solver.eigenvalues();
  const double largest = variance.cwiseAbs().maxCoeff();
  const double rounding = 1e-12 * largest;
  // Sums and differences of many covariances leave rounding errors behind.
  if (variance[0] < -1e-9 * largest) throw ParameterError("motion covariance", variance[0], ">= 0");
  const Eigen::Matrix<double, N, 1> along = solver.eigenvectors().transpose() * error;
  double exponent = 0.0;
  for (int i = 0; i < N; ++i) {
    if (variance[i] > rounding) {
      exponent += along[i] * along[i] / variance[i];
    } else if (std::abs(along[i]) > 1e-9 * std::max(1.0, error.norm())) {
      return 0.0;
    }
  }
  return std::exp(-0.5 * exponent);
}

Matrix3 crossMatrix(const Vector3& v) {
  Matrix3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

}  // namespace

double motionFactor(const Vector3& error, const Matrix3& covariance) {
  return relativeDensity<3>(error, covariance);
}

double motionFactor(const Vector6& error, const Matrix6& covariance) {
  return relativeDensity<6>(error, covariance);
}

double poseMotionFactor(const Pose& measured, const Pose& predicted, const Matrix6& covariance) {
  const Eigen::AngleAxisd turn(Matrix3(measured.linear() * predicted.linear().transpose()));
  Vector6 error;
  error << measured.translation() - predicted.translation(), turn.angle() * turn.axis();
  return motionFactor(error, covariance);
}

Matrix3 measurementCovariance(const Vector3& point, const OccupancyParams& params) {
  const double range = point.norm();
  if (!(range > 0.0)) return Matrix3::Zero();
  const double depth = depthOf(point, params.optical_axis);
  const double along = rangeError(range, depth, params.noise);
  const double across = range / params.noise.focal_length * params.noise.disparity_error;
  const Vector3 ray = point / range;
  const Matrix3 along_ray = ray * ray.transpose();
  return along * along * along_ray + across * across * (Matrix3::Identity() - along_ray);
}

double featureMotionFactor(const Vector3& now, const Vector3& before, const Pose& T_now_before,
                           const Matrix6& motion_covariance, const OccupancyParams& params) {
  const Vector3 predicted = T_now_before * before;
  const Matrix3 R = T_now_before.linear();
  // A turn dr about the sensor moves the point by dr x p = -[p]x dr.
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << Matrix3::Identity(), -crossMatrix(predicted);
  const Matrix3 covariance = jacobian * motion_covariance * jacobian.transpose() +
                             measurementCovariance(now, params) +
                             R * measurementCovariance(before, params) * R.transpose();
  return motionFactor(Vector3(now - predicted), covariance);
}

}  // namespace planar_mapping
