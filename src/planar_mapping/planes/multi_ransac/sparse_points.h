// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/planes/plane_search.h"

namespace planar_mapping::detail {

/// The points of a sparse cloud once each, as columns about a point amidst them, and who is near
/// whom.
struct SparsePoints {
  Vector3 origin = Vector3::Zero();
  std::vector<float> x, y, z;
  std::vector<float> inverse_band;       ///< 1 / d_T(z) of each
  std::vector<std::int32_t> first_near;  ///< neighbours of i: near[first_near[i]] ...
  std::vector<std::int32_t> near;
  double radius = 0.0;  ///< within which points are neighbours
  std::size_t points_not_measured = 0;
  std::size_t duplicate_points = 0;

  std::size_t size() const { return x.size(); }
};

SparsePoints prepareSparsePoints(const PointsView& points, const Indices* indices,
                                 const DistanceBand& band);

}  // namespace planar_mapping::detail
