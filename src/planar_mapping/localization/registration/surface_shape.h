// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "planar_mapping/beliefs/occupancy.h"
#include "planar_mapping/localization/registration/surface_cells.h"

namespace planar_mapping::detail {

constexpr double kEdgeError = 0.015;  ///< standard deviation of the place of an edge, metres

/// Small planes of a cloud, each with its weight.
///
/// A floor has ten times the planes of the cabinet on it, but it says nothing
/// about the turn of the camera about the vertical; with equal weights what
/// does would go for outliers. So each direction counts the same, however many
/// planes face it.
struct BalancedPlanes {
  std::vector<Surfel> planes;
  std::vector<double> weights;  ///< mean 1
};

/// What a cloud is registered by, sensor's frame.
struct CloudShape {
  BalancedPlanes fine;
  BalancedPlanes coarse;
  std::vector<Surfel> edges;
};

/// The shape of a cloud; the coarse cells are twice as large as the fine ones.
CloudShape shapeOf(const PointsView& cloud, const SurfaceMapParams& params);

/// Points of an organized cloud where a surface ends in front of something farther away: the edges
/// of a box stay where they are while it is walked around. Empty for clouds without rows.
std::vector<Vector3> occludingEdges(const PointsView& cloud);

/// Calls what(point, its depth error) for the points that count.
template <typename What>
void forSample(const PointsView& cloud, const SurfaceMapParams& params, const What& what) {
  constexpr std::size_t kSampleSize = 60000;  // points looked at
  // Points that are not there are not looked at either.
  std::vector<std::size_t> measured;
  measured.reserve(cloud.size);
  for (std::size_t i = 0; i < cloud.size; ++i) {
    if (cloud.isMeasured(i)) measured.push_back(i);
  }
  // Not a divisor of the width, so that it does not pick single columns.
  std::size_t step = measured.size() / kSampleSize + 1;
  if (step > 1 && cloud.isOrganized() && cloud.width % step == 0) ++step;
  for (std::size_t k = 0; k < measured.size(); k += step) {
    const Vector3 p = cloud.point(measured[k]);
    const double range = p.norm();
    const double depth = depthOf(p, params.optical_axis);
    const double along = depth > 0.0 ? range / depth : 1.0;
    what(p, along * (params.depth_error + params.depth_error_growth * depth * depth));
  }
}

}  // namespace planar_mapping::detail
