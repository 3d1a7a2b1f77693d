// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/raster/plane_raster.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/summed_area.h"

namespace planar_mapping {
namespace {

/// Below this sine between normal and vertical, "horizontal within the plane" means nothing.
constexpr double kHorizontalSine = 1e-6;
/// Sine of ten degrees: planes this flat take u from the caller where it gives one.
constexpr double kFlatSine = 0.17364817766693033;
/// Sine of thirty degrees: a plane whose normal rises less is steep.
constexpr double kSteepRise = 0.5;

/// The smallest rectangle around the occupied cells; zero area if there are none.
CellRectangle boundingRectangle(const CellMask& mask) {
  CellRectangle box{mask.width, mask.height, 0, 0};
  std::int32_t last_a = -1;
  std::int32_t last_b = -1;
  for (std::int32_t b = 0; b < mask.height; ++b) {
    for (std::int32_t a = 0; a < mask.width; ++a) {
      if (!mask.at(a, b)) continue;
      box.a = std::min(box.a, a);
      box.b = std::min(box.b, b);
      last_a = std::max(last_a, a);
      last_b = b;
    }
  }
  if (last_a < 0) return {};
  box.width = last_a - box.a + 1;
  box.height = last_b - box.b + 1;
  return box;
}

struct Quartering {
  const detail::SummedArea<std::int64_t>& occupied;
  double density_threshold;
  int min_width;
  int min_height;
  std::vector<CellRectangle>& leaves;

  // Depth is at most 31: both sides halve.
  void split(const CellRectangle& unit) const {
    const std::int64_t count =
        occupied.over(unit.a, unit.b, unit.a + unit.width, unit.b + unit.height);
    if (count == 0) return;
    const double density = static_cast<double>(count) / static_cast<double>(unit.area());
    if (!(density < density_threshold && unit.width > min_width && unit.height > min_height)) {
      leaves.push_back(unit);
      return;
    }
    const std::int32_t w = unit.width / 2;
    const std::int32_t h = unit.height / 2;
    split({unit.a, unit.b, w, h});
    split({unit.a + w, unit.b, unit.width - w, h});
    split({unit.a, unit.b + h, w, unit.height - h});
    split({unit.a + w, unit.b + h, unit.width - w, unit.height - h});
  }
};

void mergeAlongU(std::vector<CellRectangle>& rectangles) {
  std::sort(rectangles.begin(), rectangles.end(), [](const auto& l, const auto& r) {
    return std::tie(l.b, l.height, l.a) < std::tie(r.b, r.height, r.a);
  });
  std::vector<CellRectangle> merged;
  for (const CellRectangle& r : rectangles) {
    if (!merged.empty()) {
      CellRectangle& last = merged.back();
      if (last.b == r.b && last.height == r.height && last.a + last.width == r.a) {
        last.width += r.width;
        continue;
      }
    }
    merged.push_back(r);
  }
  rectangles = std::move(merged);
}

void swapAxes(std::vector<CellRectangle>& rectangles) {
  for (CellRectangle& r : rectangles) r = {r.b, r.a, r.height, r.width};
}

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

std::vector<CellRectangle> splitAndMerge(const CellMask& mask, double density_threshold,
                                         int min_width, int min_height, bool merge) {
  detail::requireConsistent(mask);
  requirePositive("density_threshold", density_threshold);
  requireInRange("min_width", min_width, 1, 2147483647, "cells");
  requireInRange("min_height", min_height, 1, 2147483647, "cells");
  std::vector<CellRectangle> rectangles;
  const CellRectangle whole = boundingRectangle(mask);
  if (whole.area() == 0) return rectangles;
  const detail::SummedArea<std::int64_t> occupied(mask.cells, mask.width, mask.height, 0);
  Quartering{occupied, density_threshold, min_width, min_height, rectangles}.split(whole);
  for (int axis = 0; merge && axis < 2; ++axis) {
    mergeAlongU(rectangles);
    swapAxes(rectangles);
  }
  for (CellRectangle& r : rectangles) {
    r.a += mask.a0;
    r.b += mask.b0;
  }
  std::sort(rectangles.begin(), rectangles.end(),
            [](const auto& l, const auto& r) { return std::tie(l.b, l.a) < std::tie(r.b, r.a); });
  return rectangles;
}

}  // namespace planar_mapping
