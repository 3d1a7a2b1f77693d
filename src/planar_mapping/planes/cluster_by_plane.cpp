// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/simd.h"
#include "planar_mapping/planes/multi_plane.h"
#include "planar_mapping/planes/plane_search.h"

namespace planar_mapping {

namespace {

constexpr std::size_t kBlock = 1024;

/// Gives each point the nearest of \p planes, (a, b, c, d) about the origin of the points, within
/// max(constant, per_square_depth * depth^2). \p best holds scratch of \p n floats; \p label gets
/// the plane or -1.
PLANAR_MAPPING_MULTIVERSION
void nearestPlane(const float* x, const float* y, const float* z, const float* depth, std::size_t n,
                  const float* planes, std::size_t number_of_planes, float constant,
                  float per_square_depth, float* best, std::int32_t* label) {
  // The band includes its border: start a little outside it.
  const float border = 1.0f + 1e-6f;
  for (std::size_t i = 0; i < n; ++i) {
    const float follows = per_square_depth * depth[i] * depth[i];
    best[i] = border * (follows > constant ? follows : constant);
    label[i] = -1;
  }
  for (std::size_t p = 0; p < number_of_planes; ++p) {
    const float a = planes[4 * p], b = planes[4 * p + 1];
    const float c = planes[4 * p + 2], d = planes[4 * p + 3];
    const auto name = static_cast<std::int32_t>(p);
    for (std::size_t i = 0; i < n; ++i) {
      const float signed_distance = a * x[i] + b * y[i] + c * z[i] + d;
      const float distance = signed_distance < 0.0f ? -signed_distance : signed_distance;
      const bool nearer = distance < best[i];
      best[i] = nearer ? distance : best[i];
      label[i] = nearer ? name : label[i];
    }
  }
}

}  // namespace

std::vector<std::int32_t> clusterByPlane(const PointsView& points, const std::vector<Plane>& planes,
                                         const MultiPlaneParams& params) {
  params.validate();
  const detail::DistanceBand band(params);
  std::vector<std::int32_t> labels(points.size, -1);
  if (planes.empty()) return labels;
  const std::size_t blocks = (points.size + kBlock - 1) / kBlock;
  parallelFor(blocks, params.threads, [&](std::size_t block) {
    const std::size_t begin = block * kBlock;
    const std::size_t n = std::min(kBlock, points.size - begin);
    // About the first measured point of the block: differences of near floats are exact.
    std::size_t first = 0;
    while (first < n && !points.isMeasured(begin + first)) ++first;
    if (first == n) return;
    const Vector3 origin = points.point(begin + first);
    const float ox = points[begin + first][0];
    const float oy = points[begin + first][1];
    const float oz = points[begin + first][2];
    std::array<float, kBlock> x;
    std::array<float, kBlock> y;
    std::array<float, kBlock> z;
    std::array<float, kBlock> depth;
    std::array<float, kBlock> best;
    for (std::size_t i = 0; i < n; ++i) {
      const float* p = points[begin + i];
      x[i] = points.isMeasured(begin + i) ? p[0] - ox : std::numeric_limits<float>::quiet_NaN();
      y[i] = p[1] - oy;
      z[i] = p[2] - oz;
      depth[i] = p[2];
    }
    std::vector<float> shifted;
    shifted.reserve(4 * planes.size());
    for (const Plane& plane : planes) {
      for (int axis = 0; axis < 3; ++axis) {
        shifted.push_back(static_cast<float>(plane.normal[axis]));
      }
      shifted.push_back(static_cast<float>(plane.signedDistance(origin)));
    }
    nearestPlane(x.data(), y.data(), z.data(), depth.data(), n, shifted.data(), planes.size(),
                 static_cast<float>(band.constant), static_cast<float>(band.per_square_depth),
                 best.data(), labels.data() + begin);
  });
  return labels;
}

std::vector<std::int32_t> detail::clusterIndexed(const PointsView& points, const Indices* indices,
                                                 const std::vector<Plane>& planes,
                                                 const MultiPlaneParams& params) {
  std::vector<std::int32_t> labels = clusterByPlane(points, planes, params);
  if (indices == nullptr) return labels;
  std::vector<std::int32_t> kept(labels.size(), -1);
  for (const int i : *indices) {
    kept[static_cast<std::size_t>(i)] = labels[static_cast<std::size_t>(i)];
  }
  return kept;
}

}  // namespace planar_mapping
