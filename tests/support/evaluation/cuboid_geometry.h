// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/geometry/cuboid.h"

namespace planar_mapping::test {

/// Euclidean distance from the point to the cuboid, 0 inside, metres.
inline double distanceTo(const Cuboid& cuboid, const Vector3& point) {
  const Vector3 local = cuboid.orientation.conjugate() * (point - cuboid.center);
  return (local.cwiseAbs() - 0.5 * cuboid.size).cwiseMax(0.0).norm();
}

/// An axis-aligned one.
inline Cuboid cuboidAt(const Vector3& center, const Vector3& size) {
  Cuboid cuboid;
  cuboid.center = center;
  cuboid.size = size;
  return cuboid;
}

/// The cuboid moved by T.
inline Cuboid transformed(const Cuboid& cuboid, const Pose& T) {
  Cuboid moved = cuboid;
  moved.center = T * cuboid.center;
  moved.orientation = (Quaternion(T.linear()) * cuboid.orientation).normalized();
  return moved;
}

}  // namespace planar_mapping::test
