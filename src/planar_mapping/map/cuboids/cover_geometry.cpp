// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/cuboids/cover_geometry.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {
namespace {

constexpr double kMaxThickness = 2.0;  ///< cells
constexpr double kMinFraction = 0.5;   ///< of the face, over cells of the plane

/// The box with its axes renamed: n along that of its axes which is nearest to the plane's normal.
Cuboid renamed(const Cuboid& box, const PlaneFrame& frame) {
  const Matrix3 axes = box.orientation.toRotationMatrix();
  int n = 0, u = 0;
  (axes.transpose() * frame.n).cwiseAbs().maxCoeff(&n);
  Vector3 along_u = (axes.transpose() * frame.u).cwiseAbs();
  along_u[n] = -1.0;
  along_u.maxCoeff(&u);
  const auto towards = [&](int axis, const Vector3& wanted) -> Vector3 {
    return axes.col(axis) * (axes.col(axis).dot(wanted) < 0.0 ? -1.0 : 1.0);
  };
  Matrix3 turned;
  turned.col(2) = towards(n, frame.n);
  turned.col(0) = towards(u, frame.u);
  turned.col(1) = turned.col(2).cross(turned.col(0));
  Cuboid result = box;
  result.orientation = Quaternion(turned);
  result.size = Vector3(box.size[u], box.size[3 - n - u], box.size[n]);
  return result;
}

/// Fraction of the face of a box, by squares of the size of a cell, that is over cells of a plane.
double fractionOver(const Cuboid& box, const PlaneLayer& plane, double cell) {
  const int columns = std::max(1, static_cast<int>(std::lround(box.size.x() / cell)));
  const int rows = std::max(1, static_cast<int>(std::lround(box.size.y() / cell)));
  int over = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Vector3 place(((column + 0.5) / columns - 0.5) * box.size.x(),
                          ((row + 0.5) / rows - 0.5) * box.size.y(), 0.0);
      const Vector3 at = plane.frame().toPlane(box.center + box.orientation * place);
      over += plane.raster.at(static_cast<std::int32_t>(std::floor(at.x() / cell)),
                              static_cast<std::int32_t>(std::floor(at.y() / cell)))
                  ? 1
                  : 0;
    }
  }
  return static_cast<double>(over) / (columns * rows);
}

}  // namespace

void namePlanes(const MapData& map, const std::vector<const PlaneLayer*>& near,
                std::vector<Cuboid>& boxes) {
  const double cell = map.resolution();
  const double least_cosine = std::cos(map.params.association_angle);
  for (Cuboid& box : boxes) {
    const Cuboid unnamed = box;
    double largest = 0.0;
    for (const PlaneLayer* plane : near) {
      const PlaneFrame& frame = plane->frame();
      Cuboid named = renamed(unnamed, frame);
      if ((named.orientation * Vector3::UnitZ()).dot(frame.n) < least_cosine ||
          named.size.z() > kMaxThickness * cell * (1.0 + 1e-9) ||
          std::abs(frame.toPlane(named.center).z()) > 0.5 * named.size.z() + 0.5 * cell) {
        continue;
      }
      const double fraction = fractionOver(named, *plane, cell);
      if (fraction < kMinFraction || fraction <= largest) continue;
      largest = fraction;
      box = named;
      box.plane_id = plane->id;
    }
  }
}

}  // namespace planar_mapping::detail
