// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "features/cloud_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace planar_mapping::detail {

std::optional<Vector3> pointAt(const PointsView& cloud, float column, float row) {
  constexpr double kSameSurface = 0.02;  // of the depth
  const int left = static_cast<int>(std::floor(column));
  const int top = static_cast<int>(std::floor(row));
  const auto inside = [&](int c, int r) {
    return c >= 0 && r >= 0 && c < static_cast<int>(cloud.width) &&
           r < static_cast<int>(cloud.height);
  };
  const auto indexOf = [&](int c, int r) {
    return static_cast<std::size_t>(r) * cloud.width + static_cast<std::size_t>(c);
  };
  bool all = true;
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 0.0;
  for (int k = 0; k < 4; ++k) {
    const int c = left + k % 2;
    const int r = top + k / 2;
    if (!inside(c, r) || !cloud.isMeasured(indexOf(c, r))) {
      all = false;
      break;
    }
    const double depth = cloud.point(indexOf(c, r)).z();
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  if (all && farthest - nearest <= kSameSurface * nearest) {
    const double fx = double{column} - left;
    const double fy = double{row} - top;
    const auto point = [&](int c, int r) { return cloud.point(indexOf(left + c, top + r)); };
    return Vector3((1.0 - fy) * ((1.0 - fx) * point(0, 0) + fx * point(1, 0)) +
                   fy * ((1.0 - fx) * point(0, 1) + fx * point(1, 1)));
  }
  std::optional<Vector3> front;
  const int center_column = static_cast<int>(std::lround(column));
  const int center_row = static_cast<int>(std::lround(row));
  for (int r = center_row - 1; r <= center_row + 1; ++r) {
    for (int c = center_column - 1; c <= center_column + 1; ++c) {
      if (!inside(c, r) || !cloud.isMeasured(indexOf(c, r))) continue;
      const Vector3 point = cloud.point(indexOf(c, r));
      if (!front || point.z() < front->z()) front = point;
    }
  }
  return front;
}

}  // namespace planar_mapping::detail
