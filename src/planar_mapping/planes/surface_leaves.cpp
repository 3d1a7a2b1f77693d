// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/surface_leaves.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "planar_mapping/base/point_indices.h"

namespace planar_mapping::detail {

namespace {

constexpr int kTopLevel = kLeafLevels - 1;
constexpr double kMinPoints = 6.0;
// A leaf must be this many thresholds wide, or the thickness of the surface hides its direction.
constexpr double kMinSideInBands = 3.0;
// Narrower than this fraction of the side, the points are a line and their normal is chance.
constexpr double kMinWidth = 0.05;
// Noise of ranges is no more than this fraction of the threshold, one standard deviation.
constexpr double kMaxNoise = 0.8;
// Squared thickness against squared width.
constexpr double kMaxThickness = 0.4;
// Faces two thresholds apart, less their noise, have no point near the plane between them. Where
// one has a sixth of the points, the RMS thickness is 0.37 of the gap.
constexpr double kMinGap = 1.9;
constexpr double kMinThickness = 0.37 * kMinGap;

bool isNarrow(const LocalFit& fit, double side) {
  return !(fit.eigenvalues[1] > kMinWidth * kMinWidth * side * side);
}

/// Whether the points of a ring or two of a scanner are wide only along their rays, and no more
/// than noise may make them: a plane through ring and rays is none.
bool isNoisyLine(const PointSums& sums, const Vector3& mean, const Vector3& sensor,
                 const LocalFit& fit, double side, double band) {
  if (!(fit.eigenvalues[1] < kMaxNoise * kMaxNoise * band * band)) return false;
  const Vector3 ray = (mean - sensor).normalized();
  const Matrix3 across = Matrix3::Identity() - ray * ray.transpose();
  const Matrix3 scatter = sums.moments(Vector3::Zero()).scatter() / sums.n;
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver =
      Eigen::SelfAdjointEigenSolver<Matrix3>().computeDirect(across * scatter * across,
                                                             Eigen::EigenvaluesOnly);
  return !(solver.eigenvalues()[1] > kMinWidth * kMinWidth * side * side);
}

/// Too thick for its width, but not for a surface: a larger piece may show its direction.
bool isThickAsWide(const LocalFit& fit, double band) {
  return fit.eigenvalues[0] > kMaxThickness * fit.eigenvalues[1] &&
         fit.eigenvalues[0] <= band * band;
}

/// Makes leaves level by level; what has none at one level is pooled by parent for the next.
class LeafBuilder {
 public:
  LeafBuilder(const PointCells& grid, const DistanceBand& band, const Vector3& sensor)
      : band_(band), sensor_(sensor), sums_(grid.sums) {
    result_.side = grid.side;
    for (std::size_t cell = 0; cell < grid.sums.size(); ++cell) {
      waiting_.push_back({static_cast<std::int32_t>(cell), static_cast<std::int32_t>(cell)});
      keys_.push_back(grid.table.key(cell));
    }
  }

  SurfaceLeaves run() {
    double side = result_.side;
    for (int level = 0; level <= kTopLevel; ++level, side *= 2.0) {
      const std::vector<std::int32_t> leaf = makeLeaves(level, side);
      poolTheRest(leaf, side);
    }
    sortLeavesInCells();
    return std::move(result_);
  }

 private:
  /// Piece of the level that the points of a cell of the grid wait in.
  struct Waiting {
    std::int32_t cell;
    std::int32_t piece;
  };

  void sortLeavesInCells() {
    std::vector<LeafInCell>& all = result_.leaves_in_cells;
    std::sort(all.begin(), all.end(), [](const LeafInCell& a, const LeafInCell& b) {
      return a.cell != b.cell ? a.cell < b.cell : a.leaf < b.leaf;
    });
    all.erase(std::unique(all.begin(), all.end(),
                          [](const LeafInCell& a, const LeafInCell& b) {
                            return a.cell == b.cell && a.leaf == b.leaf;
                          }),
              all.end());
  }

  /// \return leaf of each piece, -1 = none yet
  std::vector<std::int32_t> makeLeaves(int level, double side) {
    const bool last = level == kTopLevel;
    std::vector<std::int32_t> leaf(keys_.size(), -1);
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      const CellKey& key = keys_[i];
      const PointSums& sums = sums_[i];
      const Vector3 centre = Vector3(key.x + 0.5, key.y + 0.5, key.z + 0.5) * side;
      const double threshold = band_.at(centre.z() + sums.sum[2] / sums.n);
      if (!last && (sums.n < kMinPoints || side < kMinSideInBands * threshold)) continue;
      SurfaceLeaf candidate;
      if (sums.n >= kMinPoints) {
        const LocalFit fit = fitLocally(sums);
        if (!last && (isNarrow(fit, side) || isThickAsWide(fit, threshold))) continue;
        const bool line = isNoisyLine(sums, centre + fit.mean, sensor_, fit, side, threshold);
        if (!last && line) continue;
        candidate.planar = !line && isSurface(fit, side, threshold);
        candidate.mean = centre + fit.mean;
        candidate.normal = fit.normal;
        candidate.thick =
            fit.eigenvalues[0] >= kMinThickness * kMinThickness * threshold * threshold;
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
    std::size_t left = 0;
    for (const Waiting& w : waiting_) {
      const auto piece = static_cast<std::size_t>(w.piece);
      if (leaf[piece] >= 0) {
        result_.leaves_in_cells.push_back({w.cell, leaf[piece]});
      } else {
        waiting_[left++] = {w.cell, next_of[piece]};
      }
    }
    waiting_.resize(left);
    keys_.swap(next_keys);
    sums_.swap(next_sums);
  }

  const DistanceBand& band_;
  const Vector3 sensor_;
  SurfaceLeaves result_;
  std::vector<CellKey> keys_;  ///< of the pieces of the level
  std::vector<PointSums> sums_;
  std::vector<Waiting> waiting_;
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
  if (fit.eigenvalues[1] > kThinnest * fit.eigenvalues[2])
    fit.normal = solver.eigenvectors().col(0);
  return fit;
}

bool isSurface(const LocalFit& fit, double side, double band) {
  return fit.normal.squaredNorm() > 0.5 && fit.eigenvalues[0] <= band * band &&
         fit.eigenvalues[0] <= kMaxThickness * fit.eigenvalues[1] && !isNarrow(fit, side);
}

SurfaceLeaves buildSurfaceLeaves(const PointCells& grid, const DistanceBand& band,
                                 const Vector3& sensor) {
  return LeafBuilder(grid, band, sensor).run();
}

void splitFaces(const PointsView& points, const Indices* indices, const PointCells& grid,
                const Vector3& sensor, SurfaceLeaves& surface) {
  std::vector<std::int32_t> thick_in(grid.sums.size(), -1);
  std::vector<std::array<PointSums, 2>> halves;
  for (const LeafInCell& entry : surface.leaves_in_cells) {
    if (!surface.leaves[static_cast<std::size_t>(entry.leaf)].thick) continue;
    thick_in[static_cast<std::size_t>(entry.cell)] = entry.leaf;
    halves.resize(surface.leaves.size());
  }
  if (halves.empty()) return;
  for (std::size_t k = 0; k < grid.cell_of.size(); ++k) {
    const std::int32_t cell = grid.cell_of[k];
    const std::int32_t name = cell < 0 ? -1 : thick_in[static_cast<std::size_t>(cell)];
    if (name < 0) continue;
    const auto i = static_cast<std::size_t>(name);
    const SurfaceLeaf& leaf = surface.leaves[i];
    const Vector3 p = Eigen::Map<const Eigen::Vector3f>(points[at(indices, k)]).cast<double>();
    const Vector3 offset = p - surface.centreOf(leaf);
    const std::size_t side = leaf.normal.dot(p - leaf.mean) > 0.0 ? 1 : 0;
    halves[i][side].add(offset[0], offset[1], offset[2]);
  }
  for (std::size_t i = 0; i < halves.size(); ++i) {
    if (std::min(halves[i][0].n, halves[i][1].n) < kMinPoints) continue;
    const SurfaceLeaf whole = surface.leaves[i];
    const double side = surface.sideOf(whole);
    const Vector3 centre = surface.centreOf(whole);
    if (gapOfFaces(halves[i][0].moments(centre), halves[i][1].moments(centre)) <
        kMinGap * whole.band) {
      continue;
    }
    std::array<SurfaceLeaf, 2> faces = {whole, whole};
    bool planar = true;
    for (std::size_t half = 0; half < 2; ++half) {
      SurfaceLeaf& face = faces[half];
      face.sums = halves[i][half];
      const LocalFit fit = fitLocally(face.sums);
      face.mean = centre + fit.mean;
      face.normal = fit.normal;
      face.normal_deviation = std::sqrt(fit.eigenvalues[0] / (fit.eigenvalues[1] * face.sums.n));
      face.planar = isSurface(fit, side, whole.band) &&
                    !isNoisyLine(face.sums, face.mean, sensor, fit, side, whole.band);
      face.twin = static_cast<std::int32_t>(half == 0 ? surface.leaves.size() : i);
      planar = planar && face.planar;
    }
    if (!planar) continue;
    surface.leaves[i] = faces[0];
    surface.leaves.push_back(faces[1]);
  }
  std::vector<LeafInCell> all;
  for (const LeafInCell& entry : surface.leaves_in_cells) {
    all.push_back(entry);
    const std::int32_t twin = surface.leaves[static_cast<std::size_t>(entry.leaf)].twin;
    if (twin >= 0) all.push_back({entry.cell, twin});
  }
  surface.leaves_in_cells.swap(all);
}

}  // namespace planar_mapping::detail
