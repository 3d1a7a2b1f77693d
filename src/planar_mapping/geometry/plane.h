// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping {

/// a x + b y + c z + d = 0 with unit normal (a, b, c) (the paper, Eq. 1).
struct Plane {
  Vector3 normal = Vector3::UnitZ();
  double offset = 0.0;  ///< d, metres

  /// n . p + d, metres; positive on the side the normal points to.
  double signedDistance(const Vector3& point) const { return normal.dot(point) + offset; }
  Vector4 coefficients() const { return {normal.x(), normal.y(), normal.z(), offset}; }
  Plane flipped() const { return {-normal, -offset}; }
};

/// \throws ParameterError if the normal part is zero or anything is not finite
PLANAR_MAPPING_EXPORT Plane planeFromCoefficients(double a, double b, double c, double d);

/// Plane through three points, normal (q - p) x (r - p).
/// \return false if the points are coincident, collinear or non-finite; \p plane is then untouched
PLANAR_MAPPING_EXPORT bool planeFromPoints(const Vector3& p, const Vector3& q, const Vector3& r,
                                           Plane& plane);

/// The plane after its points were moved by T: p' = T p.
PLANAR_MAPPING_EXPORT Plane transformed(const Plane& plane, const Pose& T);

/// [ours] The same plane with its normal towards \p sensor, so that "behind" is -n.
PLANAR_MAPPING_EXPORT Plane orientedTowards(const Plane& plane, const Vector3& sensor);

/// Angle between the plane and the ground, theta = arccos(c / |n|), radians in [0, pi]
/// (the paper, Eq. 2; world frame, z up).
PLANAR_MAPPING_EXPORT double tilt(const Plane& plane);

/// Normalised tilt, radians in (-pi/2, pi/2] (the paper, Eq. 3).
/// [ours] c = 0, which Eq. 3 leaves open, gives pi/2; theta = pi gives 0.
PLANAR_MAPPING_EXPORT double normalizedTilt(const Plane& plane);

}  // namespace planar_mapping
