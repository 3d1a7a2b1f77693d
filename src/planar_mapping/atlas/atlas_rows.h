// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "planar_mapping/atlas/atlas_data.h"
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

/// A link by two keyframes, not yet measured.
inline Link linkBetween(LinkKind kind, const Keyframe& from, const Keyframe& to) {
  Link link;
  link.kind = kind;
  link.from_submap = from.submap;
  link.to_submap = to.submap;
  link.from_keyframe = from.id;
  link.to_keyframe = to.id;
  return link;
}

/// With errors that all measurements share, so that many of them do not average them out.
/// \param shift  standard deviation, metres; \p turn radians
inline Matrix6 withShared(const Matrix6& covariance, double shift, double turn) {
  Vector6 variance;
  variance << Vector3::Constant(shift * shift), Vector3::Constant(turn * turn);
  return covariance + Matrix6(variance.asDiagonal());
}

/// Poses nearer than this are one place: submaps that no loop has aligned differ as much.
inline bool isSamePlace(const Pose& a, const Pose& b) {
  constexpr double kSamePlace = 0.5;                      // metres
  constexpr double kSameTurn = 15.0 * kRadiansPerDegree;  // radians
  const Pose between = a.inverse() * b;
  return between.translation().norm() < kSamePlace && rotationAngle(between.linear()) < kSameTurn;
}

}  // namespace planar_mapping::detail
