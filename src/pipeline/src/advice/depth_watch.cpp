// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "advice/depth_watch.h"

#include <vector>

#include "planar_mapping/core/planes/multi_plane.h"

namespace planar_mapping::detail {
namespace {

/// The chance that two points of an organized cloud are on one plane.
double flatness(const PointsView& points) {
  MultiPlaneParams params;
  params.method = PlaneSearchMethod::Organized;
  params.distance_threshold = 0.03;
  const PlaneSet found = findPlanes(points, nullptr, params);
  const auto all = static_cast<double>(found.diagnostics.points_considered);
  double sum = 0.0;
  for (const PlaneSegment& plane : found.planes) {
    const double part = static_cast<double>(plane.inliers.size()) / all;
    sum += part * part;
  }
  return sum;
}

}  // namespace

bool DepthWatch::isBentIn(const PointsView& points, bool is_only) {
  constexpr int kLooks = 5;
  constexpr int kCertain = 2;
  constexpr double kMinFlatness = 0.05;
  // Frames of 32 recordings and simulations: up to 1.01 times as flat where depths are along the
  // axis, 1.3 to 50 times (median 3.4) where they are distances.
  constexpr double kFlatter = 1.5;
  if (looks_ >= kLooks || !points.isOrganized()) return false;
  ++looks_;
  std::vector<float> xyz(3 * points.size);
  for (std::size_t i = 0; i < points.size; ++i) {
    Vector3 p = points.point(i);
    p *= p.z() / p.norm();
    for (int k = 0; k < 3; ++k) xyz[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(p[k]);
  }
  const double flat = flatness(PointsView(xyz.data(), points.width, points.height, 3));
  if (flat >= kMinFlatness && flat > kFlatter * flatness(points)) ++bent_;
  const bool is_certain = bent_ >= (is_only ? 1 : kCertain);
  if (is_certain) looks_ = kLooks;
  return is_certain;
}

}  // namespace planar_mapping::detail
