// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <string>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"

namespace planar_mapping {
namespace {

/// Below this sine between normal and vertical, "horizontal within the plane" means nothing.
constexpr double kHorizontalSine = 1e-6;
/// Sine of ten degrees: planes this flat take u from the caller where it gives one.
constexpr double kFlatSine = 0.17364817766693033;
/// Sine of thirty degrees: a plane whose normal rises less is steep.
constexpr double kSteepRise = 0.5;

}  // namespace

PlaneFrame makePlaneFrame(const Plane& plane, const Vector3& near, const Vector3& up,
                          const Vector3& along) {
  const double length = plane.normal.norm();
  if (!(length > 0.0) || !std::isfinite(length) || !std::isfinite(plane.offset)) {
    throw InputError("plane frame: the plane's normal is zero or not finite");
  }
  if (!near.allFinite()) throw InputError("plane frame: the near point is not finite");
  const double up_length = up.norm();
  if (!(up_length > 0.0) || !std::isfinite(up_length)) {
    throw ParameterError("up", up_length, "a finite vector of length > 0");
  }
  PlaneFrame frame;
  frame.n = plane.normal / length;
  frame.origin = near - (frame.n.dot(near) + plane.offset / length) * frame.n;
  frame.u = (up / up_length).cross(frame.n);
  const Vector3 along_plane = along - along.dot(frame.n) * frame.n;
  if (frame.u.norm() < kFlatSine && along_plane.norm() > kHorizontalSine) {
    frame.u = along_plane;
  } else if (frame.u.norm() < kHorizontalSine) {
    // The axis of the cloud that is least along the normal; the lowest of equals.
    Vector3::Index axis = 0;
    frame.n.cwiseAbs().minCoeff(&axis);
    frame.u = Vector3::Unit(axis) - frame.n[axis] * frame.n;
  }
  frame.u.normalize();
  frame.v = frame.n.cross(frame.u);
  return frame;
}

Vector3 dominantDirection(const std::vector<Plane>& planes, const std::vector<double>& weights,
                          const Vector3& up) {
  if (planes.size() != weights.size()) {
    throw InputError("dominant direction: planes and weights disagree in number");
  }
  const Vector3 vertical = up.normalized();
  Vector3 direction = Vector3::Zero();
  double most = 0.0;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const Vector3& n = planes[k].normal;
    if (!(weights[k] > most) || !(std::abs(n.dot(vertical)) < kSteepRise * n.norm())) continue;
    most = weights[k];
    direction = vertical.cross(n).normalized();
  }
  return direction;
}

void detail::requireConsistent(const CellMask& mask) {
  if (mask.width >= 0 && mask.height >= 0 &&
      mask.cells.size() == static_cast<std::size_t>(mask.width) * mask.height) {
    return;
  }
  throw InputError("cell mask of " + std::to_string(mask.width) + " x " +
                   std::to_string(mask.height) + " holds " + std::to_string(mask.cells.size()) +
                   " cells");
}

}  // namespace planar_mapping
