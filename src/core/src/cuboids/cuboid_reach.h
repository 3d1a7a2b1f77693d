// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "planar_mapping/core/geometry/cuboid.h"

namespace planar_mapping::detail {

/// A cuboid with all that lies within a margin of its faces, made ready for many questions.
class CuboidReach {
 public:
  CuboidReach(const Cuboid& c, double margin)
      : to_local_(c.orientation.conjugate().toRotationMatrix()),
        offset_(-(to_local_ * c.center)),
        extent_(0.5 * c.size + Vector3::Constant(margin + 1e-9 * (1.0 + c.center.norm()))) {}

  bool holds(const Vector3& p) const { return (place(p).array() <= extent_.array()).all(); }
  /// False only if it holds nothing within \p radius of the point.
  bool mayReach(const Vector3& p, double radius) const {
    return ((place(p) - extent_).array() <= radius).all();
  }

 private:
  Vector3 place(const Vector3& p) const { return (to_local_ * p + offset_).cwiseAbs(); }

  Matrix3 to_local_;
  Vector3 offset_;
  Vector3 extent_;
};

}  // namespace planar_mapping::detail
