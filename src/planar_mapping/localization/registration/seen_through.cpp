// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/registration/seen_through.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/localization/registration/surface_shape.h"

namespace planar_mapping::detail {
namespace {

constexpr int kColumns = 180;  // of two degrees
constexpr int kRows = 90;

int rowOf(const Vector3& direction) {
  const double polar = std::acos(std::clamp(direction.z(), -1.0, 1.0));
  return std::min(static_cast<int>(polar / M_PI * kRows), kRows - 1);
}

int columnOf(const Vector3& direction) {
  const double turn = std::atan2(direction.y(), direction.x()) / (2.0 * M_PI) + 0.5;
  return std::min(static_cast<int>(turn * kColumns), kColumns - 1);
}

std::size_t binAt(int row, int column) {
  return static_cast<std::size_t>(row * kColumns + column);
}

}  // namespace

SeenRanges::SeenRanges(const PointsView& cloud, const SurfaceMapParams& params)
    : cell_(params.cell),
      ranges_(std::size_t{kRows} * kColumns, std::numeric_limits<float>::infinity()) {
  forSample(cloud, params, [&](const Vector3& p, double) {
    const double range = p.norm();
    const Vector3 direction = p / range;
    float& least = ranges_[binAt(rowOf(direction), columnOf(direction))];
    least = std::min(least, static_cast<float>(range));
  });
}

double SeenRanges::leastAround(const Vector3& direction) const {
  const int row = rowOf(direction);
  const int column = columnOf(direction);
  double least = ranges_[binAt(row, column)];
  if (!std::isfinite(least)) return least;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, kRows - 1); ++r) {
    for (int c = column - 1; c <= column + 1; ++c) {
      const double range = ranges_[binAt(r, (c + kColumns) % kColumns)];
      least = std::min(least, range);
    }
  }
  return least;
}

SeenThrough SeenRanges::compare(const std::vector<Surfel>& planes,
                                const Pose& T_sensor_planes) const {
  SeenThrough result;
  for (const Surfel& plane : planes) result += compare(plane, T_sensor_planes);
  return result;
}

SeenThrough SeenRanges::compare(const Surfel& plane, const Pose& T_sensor_plane) const {
  constexpr double kMinSlant = 0.2;  // what is seen edge-on may be anywhere
  constexpr double kSigmas = 3.0;
  const Vector3 center = T_sensor_plane * plane.center;
  const double range = center.norm();
  if (!(range > cell_)) return {};
  const Vector3 direction = center / range;
  if (-direction.dot(T_sensor_plane.linear() * plane.normal) < kMinSlant) return {};
  const double least = leastAround(direction);
  const double tolerance = cell_ + kSigmas * plane.error;
  if (!std::isfinite(least) || least < range - tolerance) return {};
  return {least > range + tolerance ? std::size_t{1} : std::size_t{0}, 1};
}

SeenThrough SeenRanges::compare(const PointsView& points, const Pose& T_sensor_points) const {
  constexpr double kPoseError = 0.2;    // metres, of a registration
  constexpr double kRangeError = 0.03;  // of the range: its turn, slant within a bin
  SeenThrough result;
  for (std::size_t i = 0; i < points.size; ++i) {
    const Vector3 point = T_sensor_points * points.point(i);
    const double range = point.norm();
    const double tolerance = kPoseError + kRangeError * range;
    if (!(range > tolerance)) continue;
    const double least = leastAround(point / range);
    if (!std::isfinite(least) || least < range - tolerance) continue;
    ++result.compared;
    if (least > range + tolerance) ++result.through;
  }
  return result;
}

void SeenRanges::markGone(SurfaceCells& cells, const Pose& T_sensor_cells) const {
  cells.markGone([&](const Surfel& plane) { return compare(plane, T_sensor_cells).through > 0; });
}

double SeenThrough::fraction() const {
  constexpr std::size_t kFewest = 30;
  return compared < kFewest ? 0.0 : static_cast<double>(through) / static_cast<double>(compared);
}

}  // namespace planar_mapping::detail
