// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "export/conventions.h"

#include <cmath>

namespace planar_mapping::io {

Colour colourOf(const Cuboid& cuboid) {
  if (cuboid.state == CellState::Unknown) return {210, 210, 210, 0.3};
  if (cuboid.plane_id < 0) return {150, 150, 152};
  const double turn = std::fmod(0.58 + 0.381966 * cuboid.plane_id, 1.0);
  const auto part = [turn](double shift) {
    const double wave = 0.5 + 0.5 * std::cos(2.0 * M_PI * (turn - shift));
    return static_cast<int>(std::lround(90.0 + 150.0 * wave));
  };
  return {part(0.0), part(1.0 / 3.0), part(2.0 / 3.0)};
}

std::string groupOf(const Cuboid& cuboid) {
  if (cuboid.state == CellState::Unknown) return "unknown";
  return cuboid.plane_id < 0 ? "no_plane" : "plane_" + std::to_string(cuboid.plane_id);
}

Vector3 rollPitchYaw(const Quaternion& q) {
  const Matrix3 R = q.normalized().toRotationMatrix();
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  if (std::hypot(R(0, 0), R(1, 0)) < 1e-9) {  // roll and yaw turn about the same axis
    return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  }
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

Quaternion turning(const Vector3& up, const Vector3& to) {
  // Of two opposite directions any axis across them will do: x, if it is one.
  if (up.dot(to) < -1.0 + 1e-12) {
    const Vector3 axis = std::abs(up.x()) < 0.9 ? Vector3::UnitX() : Vector3::UnitY();
    return Quaternion(Eigen::AngleAxisd(M_PI, (axis - axis.dot(up) * up).normalized()));
  }
  return Quaternion(Eigen::Quaterniond::FromTwoVectors(up, to));
}

}  // namespace planar_mapping::io
