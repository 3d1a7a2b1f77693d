// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/plane.h"

namespace planar_mapping {

/// Coordinates within a plane: u horizontal, v = n x u along the slope (the paper, III-F).
struct PlaneFrame {
  Vector3 origin = Vector3::Zero();  ///< a point of the plane
  Vector3 u = Vector3::UnitX();
  Vector3 v = Vector3::UnitY();
  Vector3 n = Vector3::UnitZ();  ///< the plane's normal, towards the sensor

  /// (along u, along v, height over the plane), metres.
  Vector3 toPlane(const Vector3& p) const {
    const Vector3 d = p - origin;
    return {u.dot(d), v.dot(d), n.dot(d)};
  }
  Vector3 fromPlane(const Vector3& q) const { return origin + q.x() * u + q.y() * v + q.z() * n; }
};

/// The frame of a plane: origin is the foot of \p near, u is horizontal with respect to \p up
/// (any direction in the plane, chosen deterministically, where the plane itself is horizontal).
/// \param along [ours] u of planes within ten degrees of horizontal, where the little slope that is
///              left would choose it at random; zero = none. See dominantDirection().
PLANAR_MAPPING_EXPORT PlaneFrame makePlaneFrame(const Plane& plane, const Vector3& near,
                                                const Vector3& up = Vector3::UnitZ(),
                                                const Vector3& along = Vector3::Zero());

/// [ours] Horizontal direction along the steep plane with the most weight: floors and table tops
/// that are cut along the walls need fewer rectangles. Zero if no plane is within thirty degrees of
/// vertical.
/// \param weights one per plane, for example its number of inliers
PLANAR_MAPPING_EXPORT Vector3 dominantDirection(const std::vector<Plane>& planes,
                                                const std::vector<double>& weights,
                                                const Vector3& up = Vector3::UnitZ());

/// A rectangle of cells: columns [a, a + width), rows [b, b + height) along u and v.
struct CellRectangle {
  std::int32_t a = 0;
  std::int32_t b = 0;
  std::int32_t width = 0;
  std::int32_t height = 0;
  std::int64_t area() const { return static_cast<std::int64_t>(width) * height; }
  bool operator==(const CellRectangle& o) const {
    return a == o.a && b == o.b && width == o.width && height == o.height;
  }
};

/// A dense window of on/off cells; (0, 0) of the window is cell (a0, b0) of the plane.
struct CellMask {
  std::int32_t a0 = 0;
  std::int32_t b0 = 0;
  std::int32_t width = 0;
  std::int32_t height = 0;
  std::vector<std::uint8_t> cells;  ///< row major along u, 1 = occupied

  bool at(std::int32_t a, std::int32_t b) const {  ///< window coordinates; outside is empty
    return a >= 0 && b >= 0 && a < width && b < height &&
           cells[static_cast<std::size_t>(b) * width + a] != 0;
  }
};

namespace detail {
/// \throws InputError if the number of cells is not width x height
void requireConsistent(const CellMask& mask);
}  // namespace detail

/// The paper's split and merge (III-F, Fig. 6, 8): quarter the bounding rectangle while its
/// density is below \p density_threshold (D_T) and it is wider than \p min_width (W_T) and higher
/// than \p min_height (H_T) cells, then merge neighbours of equal height along u and of equal
/// width along v.
PLANAR_MAPPING_EXPORT std::vector<CellRectangle> splitAndMerge(const CellMask& mask,
                                                               double density_threshold,
                                                               int min_width, int min_height,
                                                               bool merge = true);

}  // namespace planar_mapping
