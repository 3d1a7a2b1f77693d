// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "surface_leaves.h"

#include <algorithm>
#include <cmath>

namespace planar_mapping::detail {

namespace {

constexpr int kTopLevel = kLeafLevels - 1;
constexpr double kLeastPoints = 6.0;
// A leaf must be this many thresholds wide, or the thickness of the surface hides its direction.
constexpr double kLeastSideInBands = 3.0;
// Narrower than this share of the side, the points are a line and their normal is chance.
constexpr double kLeastWidth = 0.05;
// Squared thickness against squared width.
constexpr double kMostThickness = 0.4;

bool isNarrow(const LocalFit& fit, double side) {
  return !(fit.eigenvalues[1] > kLeastWidth * kLeastWidth * side * side);
}

/// Too thick for its width, but not for a surface: a larger piece may show its direction.
bool isThickAsWide(const LocalFit& fit, double band) {
  return fit.eigenvalues[0] > kMostThickness * fit.eigenvalues[1] &&
         fit.eigenvalues[0] <= band * band;
}

}  // namespace

LocalFit fitLocally(const PointSums& s) {
  LocalFit fit;
  const double w = 1.0 / s.n;
  const double mx = s.sum[0] * w, my = s.sum[1] * w, mz = s.sum[2] * w;
  const double a = s.outer[0] * w - mx * mx, b = s.outer[1] * w - mx * my;
  const double c = s.outer[2] * w - mx * mz, d = s.outer[3] * w - my * my;
  const double e = s.outer[4] * w - my * mz, f = s.outer[5] * w - mz * mz;
  fit.mean = {mx, my, mz};
  // Newton from below on the characteristic polynomial meets the smallest eigenvalue first.
  const double c2 = a + d + f;
  const double c1 = a * d - b * b + a * f - c * c + d * f - e * e;
  const double c0 = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d);
  double low = 0.0;
  for (int i = 0; i < 16; ++i) {
    const double value = ((low - c2) * low + c1) * low - c0;
    const double slope = (3.0 * low - 2.0 * c2) * low + c1;
    if (!(slope > 0.0)) break;
    const double step = value / slope;
    low -= step;
    if (std::abs(step) <= 1e-9 * c2) break;
  }
  low = std::clamp(low, 0.0, c2 / 3.0);
  const double rest = c2 - low;
  const double product = std::max(0.0, c1 - low * rest);
  const double root = std::sqrt(std::max(0.0, rest * rest - 4.0 * product));
  fit.eigenvalues[0] = low;
  fit.eigenvalues[1] = std::max(low, 0.5 * (rest - root));
  fit.eigenvalues[2] = 0.5 * (rest + root);
  // The eigenvector is orthogonal to all rows of M - low I: the longest cross product of two.
  const Vector3 r0(a - low, b, c), r1(b, d - low, e), r2(c, e, f - low);
  const Vector3 n01 = r0.cross(r1), n02 = r0.cross(r2), n12 = r1.cross(r2);
  const double l01 = n01.squaredNorm(), l02 = n02.squaredNorm(), l12 = n12.squaredNorm();
  const double longest = std::max({l01, l02, l12});
  if (longest > 0.0) {
    fit.normal = (longest == l01 ? n01 : longest == l02 ? n02 : n12) / std::sqrt(longest);
  }
  return fit;
}

bool isSurface(const LocalFit& fit, double side, double band) {
  return fit.normal.squaredNorm() > 0.5 && fit.eigenvalues[0] <= band * band &&
         fit.eigenvalues[0] <= kMostThickness * fit.eigenvalues[1] && !isNarrow(fit, side);
}

SurfaceLeaves buildSurfaceLeaves(const PointCells& grid, const DistanceBand& band) {
  SurfaceLeaves result;
  result.side = grid.side;
  const std::size_t cells = grid.sums.size();
  result.leaf_of_cell.assign(cells, -1);

  // Cells of the level that wait for a leaf, and for each cell of the grid the one it went to.
  std::vector<CellKey> keys(cells);
  std::vector<PointSums> sums = grid.sums;
  std::vector<std::int32_t> waiting(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    keys[i] = grid.table.key(i);
    waiting[i] = static_cast<std::int32_t>(i);
  }
  double side = grid.side;
  for (int level = 0; level <= kTopLevel; ++level, side *= 2.0) {
    std::vector<std::int32_t> leaf(keys.size(), -1);
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const CellKey& key = keys[i];
      const Vector3 centre = Vector3(key.x + 0.5, key.y + 0.5, key.z + 0.5) * side;
      const double z = centre.z() + sums[i].sum[2] / sums[i].n;
      const double threshold = band.at(z);
      const bool last = level == kTopLevel;
      if (!last && (sums[i].n < kLeastPoints || side < kLeastSideInBands * threshold)) continue;
      SurfaceLeaf candidate;
      if (sums[i].n >= kLeastPoints) {
        const LocalFit fit = fitLocally(sums[i]);
        if (!last && (isNarrow(fit, side) || isThickAsWide(fit, threshold))) continue;
        candidate.planar = isSurface(fit, side, threshold);
        candidate.mean = centre + fit.mean;
        candidate.normal = fit.normal;
      }
      candidate.key = key;
      candidate.level = level;
      candidate.sums = sums[i];
      candidate.band = threshold;
      leaf[i] = static_cast<std::int32_t>(result.leaves.size());
      result.tables[static_cast<std::size_t>(level)].insert(key);
      result.names[static_cast<std::size_t>(level)].push_back(leaf[i]);
      result.leaves.push_back(candidate);
    }
    if (level == kTopLevel) {
      for (std::size_t i = 0; i < cells; ++i) {
        if (waiting[i] >= 0) result.leaf_of_cell[i] = leaf[static_cast<std::size_t>(waiting[i])];
      }
      break;
    }
    // What has no leaf yet is pooled by parent.
    CellTable parents(keys.size() / 4);
    std::vector<CellKey> next_keys;
    std::vector<PointSums> next_sums;
    std::vector<std::int32_t> next_of(keys.size(), -1);
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (leaf[i] >= 0) continue;
      const CellKey up = keys[i].parent();
      const std::int32_t parent = parents.insert(up);
      next_of[i] = parent;
      if (static_cast<std::size_t>(parent) == next_sums.size()) {
        next_keys.push_back(up);
        next_sums.emplace_back();
      }
      const auto offset = [&](std::int32_t child) { return ((child & 1) - 0.5) * side; };
      next_sums[static_cast<std::size_t>(parent)].add(
          sums[i], {offset(keys[i].x), offset(keys[i].y), offset(keys[i].z)});
    }
    for (std::size_t i = 0; i < cells; ++i) {
      if (waiting[i] < 0) continue;
      const auto at = static_cast<std::size_t>(waiting[i]);
      if (leaf[at] >= 0) result.leaf_of_cell[i] = leaf[at];
      waiting[i] = next_of[at];
    }
    keys.swap(next_keys);
    sums.swap(next_sums);
  }
  return result;
}

}  // namespace planar_mapping::detail
