// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping::detail {

constexpr std::size_t kLargestSample = 100000;  // points that are looked at
constexpr double kOutlierFraction = 0.01;       // at either end of each axis
constexpr float kFarthest = 1e12f;              // along an axis: squares stay finite

inline bool isUsable(const PointsView& points, std::size_t i) {
  const float* p = points[i];
  // False for NaN.
  return std::abs(p[0]) <= kFarthest && std::abs(p[1]) <= kFarthest &&
         std::abs(p[2]) <= kFarthest && !(p[0] == 0.0F && p[1] == 0.0F && p[2] == 0.0F);
}

inline double quantile(std::vector<float>& values, double fraction) {
  const double place = fraction * static_cast<double>(values.size() - 1);
  return ranked(values, static_cast<std::size_t>(place));
}

/// The box of a cloud without its outliers. \param values  of its points, by axis; reordered
inline void boundsOf(std::vector<float> (&values)[3], Vector3& low, Vector3& high) {
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = quantile(values[axis], kOutlierFraction);
    high[axis] = quantile(values[axis], 1.0 - kOutlierFraction);
  }
}

}  // namespace planar_mapping::detail
