// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/angles.h"

namespace planar_mapping::detail {

// Of the rows of an AtlasData, which are in the order of their ids.

/// The id of a row to be added.
template <typename Row>
std::int64_t nextId(const std::vector<Row>& rows) {
  return rows.empty() ? 0 : rows.back().id + 1;
}

/// The row of an id that is there.
template <typename Row>
const Row& rowOf(const std::vector<Row>& rows, std::int64_t id) {
  return *std::lower_bound(rows.begin(), rows.end(), id,
                           [](const Row& one, std::int64_t number) { return one.id < number; });
}

/// Poses nearer than this are one place: submaps that no loop has aligned differ as much.
inline bool isSamePlace(const Pose& a, const Pose& b) {
  constexpr double kSamePlace = 0.5;                      // metres
  constexpr double kSameTurn = 15.0 * kRadiansPerDegree;  // radians
  const Pose between = a.inverse() * b;
  return between.translation().norm() < kSamePlace && rotationAngle(between.linear()) < kSameTurn;
}

}  // namespace planar_mapping::detail
