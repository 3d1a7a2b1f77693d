// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "planar_mapping/base/types.h"

namespace planar_mapping {

/// The rotation that turns \p up to \p to; for up = -y (a camera's frame) and to = z, forward
/// becomes y and right stays x.
inline Quaternion turning(const Vector3& up, const Vector3& to) {
  // Of two opposite directions any axis across them will do: x, if it is one.
  if (up.dot(to) < -1.0 + 1e-12) {
    const Vector3 axis = std::abs(up.x()) < 0.9 ? Vector3::UnitX() : Vector3::UnitY();
    return Quaternion(Eigen::AngleAxisd(M_PI, (axis - axis.dot(up) * up).normalized()));
  }
  return Quaternion(Eigen::Quaterniond::FromTwoVectors(up, to));
}

}  // namespace planar_mapping
