// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "planar_mapping/base/types.h"

namespace planar_mapping {

constexpr double kRadiansPerDegree = M_PI / 180.0;

/// Angle of a rotation, radians in [0, pi].
inline double rotationAngle(const Matrix3& R) {
  return Eigen::AngleAxisd(R).angle();
}

/// Between two directions of any length, radians in [0, pi].
inline double angleBetween(const Vector3& a, const Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// [v]x: its product with w is v x w.
inline Matrix3 crossMatrix(const Vector3& v) {
  Matrix3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

}  // namespace planar_mapping
