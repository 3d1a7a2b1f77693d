// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "planar_mapping/geometry/cuboid.h"

namespace planar_mapping::detail {

/// Keeps the part [from, to] of a line that lies in an axis-aligned box. \return is there one
inline bool clipToBox(const Vector3& low, const Vector3& high, const Vector3& origin,
                      const Vector3& direction, double& from, double& to) {
  for (int i = 0; i < 3; ++i) {
    if (direction[i] == 0.0) {
      if (origin[i] < low[i] || origin[i] > high[i]) return false;
      continue;
    }
    const double a = (low[i] - origin[i]) / direction[i];
    const double b = (high[i] - origin[i]) / direction[i];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return from <= to;
}

inline bool clipToCuboid(const Cuboid& cuboid, const Vector3& origin, const Vector3& direction,
                         double& from, double& to) {
  const Quaternion to_local = cuboid.orientation.conjugate();
  return clipToBox(-0.5 * cuboid.size, 0.5 * cuboid.size, to_local * (origin - cuboid.center),
                   to_local * direction, from, to);
}

/// A cuboid that is asked many times whether it meets or contains axis-aligned boxes.
class OrientedBox {
 public:
  explicit OrientedBox(const Cuboid& cuboid)
      : center_(cuboid.center),
        half_(0.5 * cuboid.size),
        axes_(cuboid.orientation.toRotationMatrix()),
        magnitudes_(axes_.cwiseAbs()),
        reach_(magnitudes_ * half_) {}

  /// Do they meet? No axis separates them: those of both and their cross products.
  /// \param half of the sides of the axis-aligned box
  bool meets(const Vector3& center, const Vector3& half) const {
    const Vector3 between = center_ - center;
    if ((between.cwiseAbs().array() > (half + reach_).array()).any()) return false;
    const Vector3 local = axes_.transpose() * between;
    const Vector3 reach = magnitudes_.transpose() * half;
    if ((local.cwiseAbs().array() > (half_ + reach).array()).any()) return false;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        const Vector3 axis = Vector3::Unit(i).cross(axes_.col(k));
        const double limit =
            half.dot(axis.cwiseAbs()) + half_.dot((axes_.transpose() * axis).cwiseAbs());
        if (std::abs(between.dot(axis)) > limit) return false;
      }
    }
    return true;
  }

  bool contains(const Vector3& center, const Vector3& half) const {
    const Vector3 local = axes_.transpose() * (center - center_);
    return ((local.cwiseAbs() + magnitudes_.transpose() * half).array() <= half_.array()).all();
  }

  /// Half sides of its axis-aligned bounds.
  const Vector3& reach() const { return reach_; }

 private:
  Vector3 center_;
  Vector3 half_;
  Matrix3 axes_;
  Matrix3 magnitudes_;
  Vector3 reach_;
};

}  // namespace planar_mapping::detail
