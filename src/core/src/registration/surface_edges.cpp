// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "registration/surface_edges.h"

#include <cmath>

namespace planar_mapping::detail {
namespace {

/// Pixels without depth that may lie between the two sides of an edge: the shadow of a projector.
constexpr std::size_t kWidestGap = 25;
/// Every second row and column will do.
constexpr std::size_t kStride = 2;

/// Edges along one row or column: `count` points, `apart` in the cloud.
void addEdges(const PointsView& cloud, const SurfaceMapParams& params, std::size_t first,
              std::size_t count, std::size_t apart, std::vector<Vector3>& edges) {
  std::size_t last = count;  // place of the last valid point
  double last_range = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = first + k * apart;
    if (!cloud.isFinite(i)) continue;
    const double range = cloud.point(i).norm();
    if (last < count && k - last <= kWidestGap) {
      const double jump = range - last_range;
      const double nearer = std::min(range, last_range);
      if (std::abs(jump) > params.edge_depth + params.edge_depth * nearer &&
          (params.max_range <= 0.0 || nearer <= params.max_range)) {
        edges.push_back(cloud.point(jump > 0.0 ? first + last * apart : i));
      }
    }
    last = k;
    last_range = range;
  }
}

}  // namespace

std::vector<Vector3> occludingEdges(const PointsView& cloud, const SurfaceMapParams& params) {
  std::vector<Vector3> edges;
  if (!cloud.isOrganized() || params.edge_depth <= 0.0) return edges;
  for (std::size_t row = 0; row < cloud.height; row += kStride) {
    addEdges(cloud, params, row * cloud.width, cloud.width, 1, edges);
  }
  for (std::size_t column = 0; column < cloud.width; column += kStride) {
    addEdges(cloud, params, column, cloud.height, cloud.width, edges);
  }
  return edges;
}

}  // namespace planar_mapping::detail
