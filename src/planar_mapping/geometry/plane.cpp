// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/geometry/plane.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"

namespace planar_mapping {

Plane planeFromCoefficients(double a, double b, double c, double d) {
  const double length = Vector3(a, b, c).stableNorm();
  if (!(length > 0.0) || !std::isfinite(length) || !std::isfinite(d)) {
    throw ParameterError("plane normal length", length, "> 0 and finite");
  }
  return {Vector3(a, b, c) / length, d / length};
}

bool planeFromPoints(const Vector3& p, const Vector3& q, const Vector3& r, Plane& plane) {
  const Vector3 pq = q - p;
  const Vector3 pr = r - p;
  const Vector3 n = pq.cross(pr);
  const double area = n.norm();
  const double longest = std::max({pq.squaredNorm(), pr.squaredNorm(), (r - q).squaredNorm()});
  // Height of the triangle over its longest side below a millionth of that side: no plane.
  if (!(area > 1e-6 * longest) || !std::isfinite(area)) return false;
  plane.normal = n / area;
  plane.offset = -plane.normal.dot(p);
  return true;
}

Plane transformed(const Plane& plane, const Pose& T) {
  const Vector3 n = T.linear() * plane.normal;
  return {n, plane.offset - n.dot(T.translation())};
}

Plane orientedTowards(const Plane& plane, const Vector3& sensor) {
  return plane.signedDistance(sensor) < 0.0 ? plane.flipped() : plane;
}

double tilt(const Plane& plane) {
  return std::acos(std::clamp(plane.normal.z() / plane.normal.norm(), -1.0, 1.0));
}

double normalizedTilt(const Plane& plane) {
  const double theta = tilt(plane);
  if (plane.normal.z() < 0.0) return theta - M_PI;
  return plane.normal.z() > 0.0 ? theta : M_PI_2;
}

}  // namespace planar_mapping
