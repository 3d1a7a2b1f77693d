// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <string>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping::detail {

/// \throws InputError if an index is not a point of the cloud, or an int cannot count its points
inline void requireIndices(const PointsView& points, const Indices* indices) {
  constexpr std::size_t kMaxPoints = std::numeric_limits<int>::max();
  if (points.size > kMaxPoints) {
    throw InputError("a cloud of " + std::to_string(points.size) +
                     " points is more than an index can count");
  }
  if (!indices) return;
  // All first, without a branch: there hardly ever is one outside. -1 is larger than any size.
  unsigned outside = 0;
  for (const int i : *indices) {
    outside |= static_cast<unsigned>(i) >= static_cast<unsigned>(points.size) ? 1U : 0U;
  }
  if (outside == 0) return;
  for (const int i : *indices) {
    if (i < 0 || static_cast<std::size_t>(i) >= points.size) {
      throw InputError("indices: " + std::to_string(i) + " is outside the cloud of " +
                       std::to_string(points.size) + " points");
    }
  }
}

inline std::size_t countOf(const PointsView& points, const Indices* indices) {
  return indices ? indices->size() : points.size;
}

/// Position in the cloud of the k-th point that counts.
inline std::size_t at(const Indices* indices, std::size_t k) {
  return indices ? static_cast<std::size_t>((*indices)[k]) : k;
}

}  // namespace planar_mapping::detail
