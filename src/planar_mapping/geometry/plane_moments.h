// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/plane.h"

namespace planar_mapping {

/// Weight, mean and scatter of a set of points: all that a least-squares plane needs, so that
/// planes are refitted over frames without keeping a point. Double precision about the mean, so
/// clouds far from the origin lose nothing.
class PLANAR_MAPPING_EXPORT PlaneMoments {
 public:
  void add(const Vector3& point, double weight = 1.0);
  void merge(const PlaneMoments& other);
  /// The moments of the same points after p' = T p.
  PlaneMoments transformed(const Pose& T) const;
  /// From sums about \p origin: n, sum of (p - origin), sum of (p - origin)(p - origin)^T.
  static PlaneMoments fromSums(double n, const Vector3& sum, const Matrix3& outer,
                               const Vector3& origin);
  double weight() const { return weight_; }
  const Vector3& mean() const { return mean_; }
  /// Sum over points of w (p - mean)(p - mean)^T, square metres.
  const Matrix3& scatter() const { return scatter_; }

  struct Fit {
    Plane plane;  ///< normal with the largest-magnitude component positive
    Vector3 eigenvalues = Vector3::Zero();  ///< of scatter / weight, ascending, square metres
    double rms = 0.0;                       ///< root mean square distance to the plane, metres
    bool valid = false;                     ///< false for fewer than 3 points or collinear ones
  };
  /// Least-squares plane.
  Fit fit() const;

  /// Covariance of (a, b, c, d) of the fitted plane under isotropic noise of variance
  /// rms^2 * weight / (weight - 3), first order. Zero if the fit is not valid.
  Matrix4 planeCovariance(const Fit& fit) const;

 private:
  double weight_ = 0.0;
  Vector3 mean_ = Vector3::Zero();
  Matrix3 scatter_ = Matrix3::Zero();
};

}  // namespace planar_mapping
