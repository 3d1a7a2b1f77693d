// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/multi_ransac/sparse_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/point_indices.h"
#include "planar_mapping/grid/cell_table.h"

namespace planar_mapping::detail {

namespace {

// Neighbours are as near as the sixth nearest of the median point.
constexpr std::size_t kRank = 6;
constexpr std::size_t kProbes = 64;
// A point in a dense spot names only so many neighbours.
constexpr std::size_t kMaxNeighbours = 32;
constexpr double kFarthestCell = 1 << 30;

/// The considered points, equal coordinates next to each other, non-finite ones left out.
std::vector<std::int32_t> sortedFinite(const PointsView& points, const Indices* indices,
                                       SparsePoints& result) {
  const std::size_t considered = countOf(points, indices);
  std::vector<std::int32_t> order;
  order.reserve(considered);
  for (std::size_t k = 0; k < considered; ++k) {
    const std::size_t i = at(indices, k);
    if (points.isMeasured(i)) {
      order.push_back(static_cast<std::int32_t>(i));
    } else {
      ++result.points_not_measured;
    }
  }
  std::sort(order.begin(), order.end(), [&](std::int32_t i, std::int32_t j) {
    const float* p = points[static_cast<std::size_t>(i)];
    const float* q = points[static_cast<std::size_t>(j)];
    return std::tie(p[0], p[1], p[2], i) < std::tie(q[0], q[1], q[2], j);
  });
  return order;
}

/// Squared distance to the kRank-th nearest of point \p i: outwards along x, as they are sorted.
float squaredRank(const SparsePoints& points, std::size_t i) {
  std::array<float, kRank> nearest;  // ascending
  nearest.fill(std::numeric_limits<float>::infinity());
  // \return whether points farther along x may still be nearer
  const auto look = [&](std::size_t j) {
    const float dx = points.x[j] - points.x[i], dy = points.y[j] - points.y[i];
    const float dz = points.z[j] - points.z[i];
    if (dx * dx > nearest.back()) return false;
    float squared = dx * dx + dy * dy + dz * dz;
    if (!(squared < nearest.back())) return true;
    for (float& other : nearest) {
      if (squared < other) std::swap(squared, other);
    }
    return true;
  };
  std::size_t up = i + 1, down = i;
  bool more_up = up<points.size(), more_down = down> 0;
  while (more_up || more_down) {
    if (more_up) more_up = look(up) && ++up < points.size();
    if (more_down) more_down = look(--down) && down > 0;
  }
  return nearest.back();
}

double chooseRadius(const SparsePoints& points) {
  const std::size_t n = points.size();
  if (n <= kRank) return std::numeric_limits<float>::max();
  std::vector<float> radii;
  const std::size_t step = std::max<std::size_t>(1, n / kProbes);
  for (std::size_t i = step / 2; i < n; i += step) radii.push_back(squaredRank(points, i));
  // Distances beyond 1e19 m have no square.
  const float squared =
      std::min(ranked(radii, radii.size() / 2), std::numeric_limits<float>::max());
  return std::sqrt(double{squared});
}

void findNeighbours(SparsePoints& points) {
  const std::size_t n = points.size();
  const double inverse_side = 1.0 / std::max(points.radius, 1e-6);
  CellTable table(n);
  std::vector<std::int32_t> cell_of(n);
  std::vector<std::int32_t> first;  // member of each cell: members[first[cell]] ...
  for (std::size_t i = 0; i < n; ++i) {
    const auto down = [&](float v) {
      const double cells = std::clamp(v * inverse_side, -kFarthestCell, kFarthestCell);
      const auto whole = static_cast<std::int32_t>(cells);
      return whole - static_cast<std::int32_t>(cells < whole);
    };
    cell_of[i] = table.insert({down(points.x[i]), down(points.y[i]), down(points.z[i])});
    const auto cell = static_cast<std::size_t>(cell_of[i]);
    if (cell == first.size()) first.push_back(0);
    ++first[cell];
  }
  std::int32_t sum = 0;
  for (std::int32_t& count : first) count = std::exchange(sum, sum + count);
  std::vector<std::int32_t> end = first;
  std::vector<std::int32_t> members(n);
  for (std::size_t i = 0; i < n; ++i) {
    members[static_cast<std::size_t>(end[static_cast<std::size_t>(cell_of[i])]++)] =
        static_cast<std::int32_t>(i);
  }
  // The cells with points around each cell, itself first.
  std::vector<std::int32_t> around;
  std::vector<std::size_t> first_around(1, 0);
  around.reserve(8 * first.size());
  for (std::size_t cell = 0; cell < first.size(); ++cell) {
    const CellKey key = table.key(cell);
    around.push_back(static_cast<std::int32_t>(cell));
    for (std::int32_t dz = -1; dz <= 1; ++dz) {
      for (std::int32_t dy = -1; dy <= 1; ++dy) {
        for (std::int32_t dx = -1; dx <= 1; ++dx) {
          if (dx == 0 && dy == 0 && dz == 0) continue;
          const std::int32_t other = table.find({key.x + dx, key.y + dy, key.z + dz});
          if (other >= 0) around.push_back(other);
        }
      }
    }
    first_around.push_back(around.size());
  }
  const auto limit = static_cast<float>(points.radius * points.radius);
  points.first_near.assign(1, 0);
  points.first_near.reserve(n + 1);
  points.near.reserve(8 * n);
  for (std::size_t i = 0; i < n; ++i) {
    const float x = points.x[i], y = points.y[i], z = points.z[i];
    const auto home = static_cast<std::size_t>(cell_of[i]);
    const std::size_t most = points.near.size() + kMaxNeighbours;
    for (std::size_t c = first_around[home]; c < first_around[home + 1]; ++c) {
      const auto cell = static_cast<std::size_t>(around[c]);
      for (std::int32_t m = first[cell]; m < end[cell] && points.near.size() < most; ++m) {
        const std::int32_t j = members[static_cast<std::size_t>(m)];
        const auto k = static_cast<std::size_t>(j);
        const float dx = points.x[k] - x, dy = points.y[k] - y, dz = points.z[k] - z;
        if (k != i && dx * dx + dy * dy + dz * dz <= limit) points.near.push_back(j);
      }
    }
    points.first_near.push_back(static_cast<std::int32_t>(points.near.size()));
  }
}

}  // namespace

SparsePoints prepareSparsePoints(const PointsView& points, const Indices* indices,
                                 const DistanceBand& band) {
  SparsePoints result;
  const std::vector<std::int32_t> order = sortedFinite(points, indices, result);
  if (order.empty()) return result;
  // The middle one along x is amidst the points and, unlike a mean, one of them.
  const float* middle = points[static_cast<std::size_t>(order[order.size() / 2])];
  result.origin = Vector3(middle[0], middle[1], middle[2]);
  const float* before = nullptr;
  for (const std::int32_t i : order) {
    const float* p = points[static_cast<std::size_t>(i)];
    if (before != nullptr && p[0] == before[0] && p[1] == before[1] && p[2] == before[2]) {
      ++result.duplicate_points;
    } else {
      result.x.push_back(p[0] - middle[0]);
      result.y.push_back(p[1] - middle[1]);
      result.z.push_back(p[2] - middle[2]);
      result.inverse_band.push_back(static_cast<float>(1.0 / band.at(p[2])));
    }
    before = p;
  }
  result.radius = chooseRadius(result);
  findNeighbours(result);
  return result;
}

}  // namespace planar_mapping::detail
