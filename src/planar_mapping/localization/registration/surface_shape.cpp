// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/registration/surface_shape.h"

#include <algorithm>

namespace planar_mapping::detail {
namespace {

/// Planes that count the neighbours of each: more of them tell no more about
/// how many there are.
constexpr std::size_t kMaxCounted = 1500;
/// Pixels without depth that may lie between the two sides of an edge: the shadow of a projector.
constexpr std::size_t kWidestGap = 25;
/// Every second row and column will do.
constexpr std::size_t kStride = 2;
/// A surface ends where the next one is farther away by this, metres, plus this fraction of its
/// range.
constexpr double kEdgeDepth = 0.08;

/// Edges along one row or column: `count` points, `apart` in the cloud.
void addEdges(const PointsView& cloud, std::size_t first, std::size_t count, std::size_t apart,
              std::vector<Vector3>& edges) {
  std::size_t last = count;  // place of the last valid point
  double last_range = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = first + k * apart;
    if (!cloud.isMeasured(i)) continue;
    const double range = cloud.point(i).norm();
    if (last < count && k - last <= kWidestGap) {
      const double jump = range - last_range;
      const double nearer = std::min(range, last_range);
      if (std::abs(jump) > kEdgeDepth + kEdgeDepth * nearer) {
        edges.push_back(cloud.point(jump > 0.0 ? first + last * apart : i));
      }
    }
    last = k;
    last_range = range;
  }
}

/// Weights of planes by how many face the same way. O(planes^2).
std::vector<double> directionWeights(const std::vector<Surfel>& planes) {
  constexpr double kSameDirection = 0.35;  // radians
  constexpr double kMinDirection = 0.05;   // of all planes: fewer count as if they were so many
  const std::size_t stride = planes.size() / kMaxCounted + 1;
  std::vector<float> x;
  std::vector<float> y;
  std::vector<float> z;
  for (std::size_t i = 0; i < planes.size(); i += stride) {
    x.push_back(static_cast<float>(planes[i].normal.x()));
    y.push_back(static_cast<float>(planes[i].normal.y()));
    z.push_back(static_cast<float>(planes[i].normal.z()));
  }
  const auto cosine = static_cast<float>(std::cos(kSameDirection));
  const double least = std::max(1.0, kMinDirection * static_cast<double>(x.size()));
  std::vector<double> weights;
  weights.reserve(planes.size());
  double sum = 0.0;
  for (const Surfel& plane : planes) {
    const auto nx = static_cast<float>(plane.normal.x());
    const auto ny = static_cast<float>(plane.normal.y());
    const auto nz = static_cast<float>(plane.normal.z());
    int same = 0;
    for (std::size_t j = 0; j < x.size(); ++j) {
      same += x[j] * nx + y[j] * ny + z[j] * nz > cosine ? 1 : 0;
    }
    weights.push_back(1.0 / std::max(static_cast<double>(same), least));
    sum += weights.back();
  }
  for (double& weight : weights) weight *= static_cast<double>(planes.size()) / sum;
  return weights;
}

}  // namespace

std::vector<Vector3> occludingEdges(const PointsView& cloud) {
  std::vector<Vector3> edges;
  if (!cloud.isOrganized()) return edges;
  for (std::size_t row = 0; row < cloud.height; row += kStride) {
    addEdges(cloud, row * cloud.width, cloud.width, 1, edges);
  }
  for (std::size_t column = 0; column < cloud.width; column += kStride) {
    addEdges(cloud, column, cloud.height, cloud.width, edges);
  }
  return edges;
}

CloudShape shapeOf(const PointsView& cloud, const SurfaceMapParams& params) {
  SurfaceCells fine(params.cell);
  SurfaceCells coarse(2.0 * params.cell);
  SurfaceCells edges(2.0 * params.cell, CellShape::Line);
  forSample(cloud, params, [&](const Vector3& p, double error) {
    fine.add(p, Vector3::Zero(), error, 0);
    coarse.add(p, Vector3::Zero(), error, 0);
  });
  for (const Vector3& p : occludingEdges(cloud)) {
    edges.add(p, Vector3::Zero(), kEdgeError, 0);
  }
  for (SurfaceCells* cells : {&fine, &coarse, &edges}) cells->fit();
  CloudShape shape;
  shape.fine.planes = fine.planes();
  shape.fine.weights = directionWeights(shape.fine.planes);
  shape.coarse.planes = coarse.planes();
  shape.coarse.weights = directionWeights(shape.coarse.planes);
  shape.edges = edges.planes();
  return shape;
}

}  // namespace planar_mapping::detail
