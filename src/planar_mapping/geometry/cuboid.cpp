// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/geometry/cuboid.h"

namespace planar_mapping {

const char* toString(CellState state) {
  switch (state) {
    case CellState::Free:
      return "free";
    case CellState::Occupied:
      return "occupied";
    case CellState::Unknown:
      return "unknown";
  }
  return "invalid";
}

bool contains(const Cuboid& cuboid, const Vector3& point, double margin) {
  const Vector3 local = cuboid.orientation.conjugate() * (point - cuboid.center);
  return (local.cwiseAbs().array() <= 0.5 * cuboid.size.array() + margin).all();
}

Vector3 reach(const Cuboid& cuboid) {
  return cuboid.orientation.toRotationMatrix().cwiseAbs() * (0.5 * cuboid.size);
}

double halfAlong(const Cuboid& cuboid, const Vector3& direction) {
  const Matrix3 to_local = cuboid.orientation.toRotationMatrix().transpose();
  return 0.5 * (to_local * direction).cwiseAbs().dot(cuboid.size);
}

std::array<Vector3, 8> corners(const Cuboid& cuboid) {
  std::array<Vector3, 8> result;
  const Matrix3 axes = cuboid.orientation.toRotationMatrix();
  for (unsigned i = 0; i < 8; ++i) {
    const Vector3 sign((i & 1u) ? 0.5 : -0.5, (i & 2u) ? 0.5 : -0.5, (i & 4u) ? 0.5 : -0.5);
    result[i] = cuboid.center + axes * sign.cwiseProduct(cuboid.size);
  }
  return result;
}

}  // namespace planar_mapping
