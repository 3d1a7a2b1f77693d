// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/store/plane_layer.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {

void PlaneLayer::setFrame(const PlaneFrame& wanted) {
  frame_ = wanted;
  frame_.v = frame_.n.cross(frame_.u);
  plane_ = {frame_.n, -frame_.n.dot(frame_.origin)};
  ++frame_revision_;
}

void PlaneLayer::setMoments(const PlaneMoments& moments) {
  const Matrix3 symmetric = 0.5 * (moments.scatter() + moments.scatter().transpose());
  moments_ = PlaneMoments::fromSums(moments.weight(), Vector3::Zero(), symmetric, moments.mean());
}

void PlaneLayer::setCell(std::int32_t a, std::int32_t b, std::uint8_t belief) {
  raster.tileAt(a >> 3, b >> 3).setBelief(static_cast<std::size_t>(8 * (b & 7) + (a & 7)), belief);
  raster.markDirty(a >> 3, b >> 3);
}

TileWindow PlaneLayer::extent() const {
  const TileWindow w = raster.window();
  return w.empty() ? w : TileWindow{8 * w.low_a, 8 * w.low_b, 8 * w.high_a + 7, 8 * w.high_b + 7};
}

Eigen::AlignedBox3d PlaneLayer::bounds(double s, double thickness) const {
  const TileWindow w = extent();
  if (w.empty()) return {};
  const PlaneFrame& f = frame();
  const Vector3 middle = f.fromPlane(
      {0.5 * s * (w.low_a + w.high_a + 1), 0.5 * s * (w.low_b + w.high_b + 1), -0.5 * thickness});
  const Vector3 half = 0.5 * s * (w.high_a - w.low_a + 1) * f.u.cwiseAbs() +
                       0.5 * s * (w.high_b - w.low_b + 1) * f.v.cwiseAbs() +
                       0.5 * thickness * f.n.cwiseAbs();
  return {middle - half, middle + half};
}

bool PlaneLayer::cellOf(const Vector3& point, double s, std::int32_t& a, std::int32_t& b) const {
  const PlaneFrame& f = frame();
  const Vector3 d = point - f.origin;
  const double u = std::floor(f.u.dot(d) / s);
  const double v = std::floor(f.v.dot(d) / s);
  if (!(std::abs(u) < kLatticeLimit) || !(std::abs(v) < kLatticeLimit)) return false;
  a = static_cast<std::int32_t>(u);
  b = static_cast<std::int32_t>(v);
  return true;
}

bool PlaneLayer::refit(double s, double tolerance) {
  const PlaneMoments::Fit fit = moments().fit();
  if (!fit.valid) return false;
  const Plane plane = fit.plane.normal.dot(frame().n) < 0.0 ? fit.plane.flipped() : fit.plane;
  const TileWindow w = extent();
  if (w.empty()) return false;
  double deviation = 0.0;
  for (const std::int32_t a : {w.low_a, w.high_a + 1}) {
    for (const std::int32_t b : {w.low_b, w.high_b + 1}) {
      const Vector3 corner = frame().fromPlane({a * s, b * s, 0.0});
      deviation = std::max(deviation, std::abs(plane.signedDistance(corner)));
    }
  }
  if (!(deviation > tolerance)) return false;

  // The new frame keeps the in-plane coordinates of the middle of the points.
  const PlaneFrame before = frame();
  const Vector3 middle = before.toPlane(moments().mean());
  const Vector3 along = before.u - plane.normal.dot(before.u) * plane.normal;
  if (!(along.norm() > 0.5)) return false;  // turned by more than any association allows
  PlaneFrame after;
  after.n = plane.normal;
  after.u = along.normalized();
  after.v = after.n.cross(after.u);
  const Vector3 mean = moments().mean();
  const Vector3 foot = mean - plane.signedDistance(mean) * after.n;
  after.origin = foot - middle.x() * after.u - middle.y() * after.v;
  setFrame(after);
  return true;
}

}  // namespace planar_mapping::detail
