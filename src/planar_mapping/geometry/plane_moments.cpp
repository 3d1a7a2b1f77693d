// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/geometry/plane_moments.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace planar_mapping {

void PlaneMoments::add(const Vector3& point, double weight) {
  if (!(weight > 0.0)) return;
  weight_ += weight;
  const Vector3 before = point - mean_;
  mean_ += before * (weight / weight_);
  scatter_ += weight * before * (point - mean_).transpose();
}

void PlaneMoments::merge(const PlaneMoments& other) {
  if (!(other.weight_ > 0.0)) return;
  const double total = weight_ + other.weight_;
  const Vector3 apart = other.mean_ - mean_;
  scatter_ += other.scatter_ + (weight_ * other.weight_ / total) * apart * apart.transpose();
  mean_ += apart * (other.weight_ / total);
  weight_ = total;
}

PlaneMoments PlaneMoments::transformed(const Pose& T) const {
  PlaneMoments moved;
  moved.weight_ = weight_;
  moved.mean_ = T * mean_;
  moved.scatter_ = T.linear() * scatter_ * T.linear().transpose();
  return moved;
}

PlaneMoments PlaneMoments::fromSums(double n, const Vector3& sum, const Matrix3& outer,
                                    const Vector3& origin) {
  PlaneMoments moments;
  if (!(n > 0.0)) return moments;
  const Vector3 mean = sum / n;
  moments.weight_ = n;
  moments.mean_ = origin + mean;
  moments.scatter_ = outer - n * mean * mean.transpose();
  return moments;
}

PlaneMoments::Fit PlaneMoments::fit() const {
  Fit result;
  if (!(weight_ >= 3.0)) return result;
  const Matrix3 covariance = 0.5 / weight_ * (scatter_ + scatter_.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(covariance);
  result.eigenvalues = solver.eigenvalues().cwiseMax(0.0);
  Vector3 n = solver.eigenvectors().col(0);
  Eigen::Index largest = 0;
  n.cwiseAbs().maxCoeff(&largest);
  if (n[largest] < 0.0) n = -n;
  result.plane = {n, -n.dot(mean_)};
  result.rms = std::sqrt(result.eigenvalues[0]);
  // A line has two vanishing eigenvalues; a point three.
  result.valid = result.eigenvalues[1] > 1e-12 * result.eigenvalues[2] && n.allFinite() &&
                 result.eigenvalues[2] > 0.0;
  return result;
}

Matrix4 PlaneMoments::planeCovariance(const Fit& fit) const {
  Matrix4 covariance = Matrix4::Zero();
  if (!fit.valid || !(weight_ > 3.0)) return covariance;
  const double variance = fit.eigenvalues[0] / (weight_ - 3.0) * weight_;
  const Matrix3 symmetric = 0.5 / weight_ * (scatter_ + scatter_.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(symmetric);
  // To first order the normal turns about the two in-plane axes and the plane shifts at the mean.
  Matrix3 normal_part = Matrix3::Zero();
  for (int axis = 1; axis < 3; ++axis) {
    const double spread = weight_ * solver.eigenvalues()[axis];
    if (!(spread > 0.0)) continue;
    const Vector3 direction = solver.eigenvectors().col(axis);
    normal_part += variance / spread * direction * direction.transpose();
  }
  covariance.topLeftCorner<3, 3>() = normal_part;
  covariance.topRightCorner<3, 1>() = -normal_part * mean_;
  covariance.bottomLeftCorner<1, 3>() = covariance.topRightCorner<3, 1>().transpose();
  covariance(3, 3) = mean_.dot(normal_part * mean_) + variance / weight_;
  return covariance;
}

}  // namespace planar_mapping
