// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "sparse_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "cell_table.h"

namespace planar_mapping::detail {

namespace {

// Neighbours are as near as the sixth nearest of the median point.
constexpr std::size_t kRank = 6;
constexpr std::size_t kProbes = 64;
// A point in a dense spot names only so many neighbours.
constexpr std::size_t kMostNeighbours = 32;
constexpr double kFarthestCell = 1 << 30;

/// Places of the considered points, equal coordinates next to each other, non-finite ones left out.
std::vector<std::int32_t> sortedFinite(const PointsView& points, const Indices* indices,
                                       SparsePoints& result) {
  const std::size_t considered = indices != nullptr ? indices->size() : points.size;
  std::vector<std::int32_t> order;
  order.reserve(considered);
  const auto at = [&](std::int32_t k) {
    return points[indices != nullptr
                      ? static_cast<std::size_t>((*indices)[static_cast<std::size_t>(k)])
                      : static_cast<std::size_t>(k)];
  };
  for (std::size_t k = 0; k < considered; ++k) {
    const float* p = at(static_cast<std::int32_t>(k));
    if (std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2])) {
      order.push_back(static_cast<std::int32_t>(k));
    } else {
      ++result.points_not_finite;
    }
  }
  std::sort(order.begin(), order.end(), [&](std::int32_t i, std::int32_t j) {
    const float* p = at(i);
    const float* q = at(j);
    if (p[0] != q[0]) return p[0] < q[0];
    if (p[1] != q[1]) return p[1] < q[1];
    if (p[2] != q[2]) return p[2] < q[2];
    return i < j;
  });
  return order;
}

double chooseRadius(const SparsePoints& points) {
  const std::size_t n = points.size();
  if (n <= kRank) return std::numeric_limits<float>::max();
  std::vector<float> radii;
  std::vector<float> squared(n);
  const std::size_t step = std::max<std::size_t>(1, n / kProbes);
  for (std::size_t i = step / 2; i < n; i += step) {
    for (std::size_t j = 0; j < n; ++j) {
      const float dx = points.x[j] - points.x[i], dy = points.y[j] - points.y[i];
      const float dz = points.z[j] - points.z[i];
      squared[j] = dx * dx + dy * dy + dz * dz;
    }
    std::nth_element(squared.begin(), squared.begin() + kRank, squared.end());
    radii.push_back(squared[kRank]);
  }
  const auto half = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), half, radii.end());
  return std::sqrt(static_cast<double>(*half));
}

void findNeighbours(SparsePoints& points) {
  const std::size_t n = points.size();
  const double side = std::max(points.radius, 1e-6);
  CellTable table(n);
  std::vector<std::int32_t> cell_of(n);
  std::vector<std::vector<std::int32_t>> members;
  for (std::size_t i = 0; i < n; ++i) {
    const auto down = [&](float v) {
      return static_cast<std::int32_t>(
          std::floor(std::clamp(v / side, -kFarthestCell, kFarthestCell)));
    };
    cell_of[i] = table.insert({down(points.x[i]), down(points.y[i]), down(points.z[i])});
    if (static_cast<std::size_t>(cell_of[i]) == members.size()) members.emplace_back();
    members[static_cast<std::size_t>(cell_of[i])].push_back(static_cast<std::int32_t>(i));
  }
  const auto limit = static_cast<float>(points.radius * points.radius);
  points.first_near.assign(1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    const CellKey key = table.key(static_cast<std::size_t>(cell_of[i]));
    const std::size_t most = points.near.size() + kMostNeighbours;
    for (int offset = 0; offset < 27 && points.near.size() < most; ++offset) {
      // The cell itself first, then those around.
      const int o = offset == 0 ? 13 : offset <= 13 ? offset - 1 : offset;
      const std::int32_t cell =
          table.find({key.x + o % 3 - 1, key.y + o / 3 % 3 - 1, key.z + o / 9 - 1});
      if (cell < 0) continue;
      for (const std::int32_t j : members[static_cast<std::size_t>(cell)]) {
        const auto k = static_cast<std::size_t>(j);
        if (k == i) continue;
        const float dx = points.x[k] - points.x[i], dy = points.y[k] - points.y[i];
        const float dz = points.z[k] - points.z[i];
        if (!(dx * dx + dy * dy + dz * dz <= limit)) continue;
        points.near.push_back(j);
        if (points.near.size() == most) break;
      }
    }
    points.first_near.push_back(static_cast<std::int32_t>(points.near.size()));
  }
}

}  // namespace

SparsePoints prepareSparsePoints(const PointsView& points, const Indices* indices,
                                 const DistanceBand& band) {
  SparsePoints result;
  const std::size_t considered = indices != nullptr ? indices->size() : points.size;
  result.unique_of.assign(considered, -1);
  const std::vector<std::int32_t> order = sortedFinite(points, indices, result);
  if (order.empty()) return result;
  const auto at = [&](std::int32_t k) {
    return points[indices != nullptr
                      ? static_cast<std::size_t>((*indices)[static_cast<std::size_t>(k)])
                      : static_cast<std::size_t>(k)];
  };
  // The middle one along x is amidst the points and, unlike a mean, one of them.
  const float* middle = at(order[order.size() / 2]);
  result.origin = Vector3(middle[0], middle[1], middle[2]);
  const float* before = nullptr;
  for (const std::int32_t k : order) {
    const float* p = at(k);
    if (before != nullptr && p[0] == before[0] && p[1] == before[1] && p[2] == before[2]) {
      ++result.duplicate_points;
    } else {
      result.x.push_back(p[0] - middle[0]);
      result.y.push_back(p[1] - middle[1]);
      result.z.push_back(p[2] - middle[2]);
      result.inverse_band.push_back(static_cast<float>(1.0 / band.at(p[2])));
    }
    before = p;
    result.unique_of[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(result.size() - 1);
  }
  result.radius = chooseRadius(result);
  findNeighbours(result);
  return result;
}

}  // namespace planar_mapping::detail
