// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/surface_leaves.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

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

/// Makes leaves level by level; what has none at one level is pooled by parent for the next.
class LeafBuilder {
 public:
  LeafBuilder(const PointCells& grid, const DistanceBand& band) : band_(band), sums_(grid.sums) {
    result_.side = grid.side;
    for (std::size_t i = 0; i < sums_.size(); ++i) keys_.push_back(grid.table.key(i));
    piece_of_cell_.resize(sums_.size());
    std::iota(piece_of_cell_.begin(), piece_of_cell_.end(), 0);
    result_.leaf_of_cell.assign(sums_.size(), -1);
  }

  SurfaceLeaves run() {
    double side = result_.side;
    for (int level = 0; level <= kTopLevel; ++level, side *= 2.0) {
      const std::vector<std::int32_t> leaf = makeLeaves(level, side);
      poolTheRest(leaf, side);
    }
    return std::move(result_);
  }

 private:
  /// \return leaf of each piece, -1 = none yet
  std::vector<std::int32_t> makeLeaves(int level, double side) {
    const bool last = level == kTopLevel;
    std::vector<std::int32_t> leaf(keys_.size(), -1);
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      const CellKey& key = keys_[i];
      const PointSums& sums = sums_[i];
      const Vector3 centre = Vector3(key.x + 0.5, key.y + 0.5, key.z + 0.5) * side;
      const double threshold = band_.at(centre.z() + sums.sum[2] / sums.n);
      if (!last && (sums.n < kLeastPoints || side < kLeastSideInBands * threshold)) continue;
      SurfaceLeaf candidate;
      if (sums.n >= kLeastPoints) {
        const LocalFit fit = fitLocally(sums);
        if (!last && (isNarrow(fit, side) || isThickAsWide(fit, threshold))) continue;
        candidate.planar = isSurface(fit, side, threshold);
        candidate.mean = centre + fit.mean;
        candidate.normal = fit.normal;
        if (candidate.planar) {
          candidate.normal_deviation =
              std::sqrt(fit.eigenvalues[0] / (fit.eigenvalues[1] * sums.n));
        }
      }
      candidate.key = key;
      candidate.level = level;
      candidate.sums = sums;
      candidate.band = threshold;
      leaf[i] = static_cast<std::int32_t>(result_.leaves.size());
      result_.tables[static_cast<std::size_t>(level)].insert(key);
      result_.names[static_cast<std::size_t>(level)].push_back(leaf[i]);
      result_.leaves.push_back(candidate);
    }
    return leaf;
  }

  void poolTheRest(const std::vector<std::int32_t>& leaf, double side) {
    CellTable parents(keys_.size() / 4);
    std::vector<CellKey> next_keys;
    std::vector<PointSums> next_sums;
    std::vector<std::int32_t> next_of(keys_.size(), -1);
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      if (leaf[i] >= 0) continue;
      const CellKey up = keys_[i].parent();
      const std::int32_t parent = parents.insert(up);
      next_of[i] = parent;
      if (static_cast<std::size_t>(parent) == next_sums.size()) {
        next_keys.push_back(up);
        next_sums.emplace_back();
      }
      const auto offset = [&](std::int32_t child) { return ((child & 1) - 0.5) * side; };
      next_sums[static_cast<std::size_t>(parent)].add(
          sums_[i], {offset(keys_[i].x), offset(keys_[i].y), offset(keys_[i].z)});
    }
    for (std::size_t cell = 0; cell < piece_of_cell_.size(); ++cell) {
      if (result_.leaf_of_cell[cell] >= 0) continue;
      const auto piece = static_cast<std::size_t>(piece_of_cell_[cell]);
      result_.leaf_of_cell[cell] = leaf[piece];
      piece_of_cell_[cell] = next_of[piece];
    }
    keys_.swap(next_keys);
    sums_.swap(next_sums);
  }

  const DistanceBand& band_;
  SurfaceLeaves result_;
  std::vector<CellKey> keys_;  ///< of the pieces of the level
  std::vector<PointSums> sums_;
  std::vector<std::int32_t> piece_of_cell_;  ///< that the points of cells without a leaf wait in
};

}  // namespace

LocalFit fitLocally(const PointSums& sums) {
  const PlaneMoments moments = sums.moments(Vector3::Zero());
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver =
      Eigen::SelfAdjointEigenSolver<Matrix3>().computeDirect(moments.scatter() / sums.n);
  LocalFit fit;
  fit.mean = moments.mean();
  fit.eigenvalues = solver.eigenvalues().cwiseMax(0.0);
  // A line has no plane.
  constexpr double kThinnest = 1e-12;
  if (fit.eigenvalues[1] > kThinnest * fit.eigenvalues[2]) fit.normal = solver.eigenvectors().col(0);
  return fit;
}

bool isSurface(const LocalFit& fit, double side, double band) {
  return fit.normal.squaredNorm() > 0.5 && fit.eigenvalues[0] <= band * band &&
         fit.eigenvalues[0] <= kMostThickness * fit.eigenvalues[1] && !isNarrow(fit, side);
}

SurfaceLeaves buildSurfaceLeaves(const PointCells& grid, const DistanceBand& band) {
  return LeafBuilder(grid, band).run();
}

}  // namespace planar_mapping::detail
