// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/unorganized/cell_assignment.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/point_indices.h"

namespace planar_mapping::detail {

namespace {

constexpr std::size_t kChunk = 65536;

struct Nearest {
  std::int32_t plane = -1;
  double distance = std::numeric_limits<double>::infinity();
  bool above = false;
};

Nearest nearestCandidate(const float* p, const std::array<std::int32_t, kPlanesPerCell>& cell,
                         const std::vector<Plane>& planes) {
  Nearest best;
  for (const std::int32_t candidate : cell) {
    if (candidate < 0) break;
    const Plane& plane = planes[static_cast<std::size_t>(candidate)];
    const Vector3& n = plane.normal;
    const double signed_distance = n[0] * p[0] + n[1] * p[1] + n[2] * p[2] + plane.offset;
    const double distance = std::abs(signed_distance);
    if (distance < best.distance) best = {candidate, distance, signed_distance > 0.0};
  }
  return best;
}

/// Calls visit(chunk, point, nearest) for the points of cells with candidates, in chunks on
/// several threads.
template <typename Visit>
void forEachNearest(const PointsView& points, const Indices* indices, const PointCells& grid,
                    const CellCandidates& candidates, const std::vector<Plane>& planes, int threads,
                    const Visit& visit) {
  const std::size_t considered = grid.cell_of.size();
  parallelFor((considered + kChunk - 1) / kChunk, threads, [&](std::size_t chunk) {
    const std::size_t end = std::min(considered, (chunk + 1) * kChunk);
    for (std::size_t k = chunk * kChunk; k < end; ++k) {
      if (grid.cell_of[k] < 0) continue;
      const auto& cell = candidates[static_cast<std::size_t>(grid.cell_of[k])];
      if (cell[0] < 0) continue;
      const std::size_t i = at(indices, k);
      visit(chunk, i, nearestCandidate(points[i], cell, planes));
    }
  });
}

}  // namespace

void addCandidate(std::array<std::int32_t, kPlanesPerCell>& cell, std::int32_t plane) {
  for (std::int32_t& candidate : cell) {
    if (candidate == plane) return;
    if (candidate < 0) {
      candidate = plane;
      return;
    }
  }
}

std::vector<std::int32_t> planesOfLeaves(const SurfaceLeaves& surface,
                                         const std::vector<LeafPlane>& planes) {
  std::vector<std::int32_t> plane_of_leaf(surface.leaves.size(), -1);
  for (std::size_t k = 0; k < planes.size(); ++k) {
    for (const std::int32_t leaf : planes[k].support) {
      plane_of_leaf[static_cast<std::size_t>(leaf)] = static_cast<std::int32_t>(k);
    }
  }
  return plane_of_leaf;
}

CellCandidates candidatesOfCells(const PointCells& grid, const SurfaceLeaves& surface,
                                 const std::vector<LeafPlane>& planes, const DistanceBand& band) {
  std::array<std::int32_t, kPlanesPerCell> none;
  none.fill(-1);
  CellCandidates candidates(grid.sums.size(), none);
  const std::vector<std::int32_t> plane_of_leaf = planesOfLeaves(surface, planes);
  for (const LeafInCell& entry : surface.leaves_in_cells) {
    const std::int32_t k = plane_of_leaf[static_cast<std::size_t>(entry.leaf)];
    if (k < 0) continue;
    const auto cell = static_cast<std::size_t>(entry.cell);
    const Plane& plane = planes[static_cast<std::size_t>(k)].plane;
    const double half_cell = 0.5 * grid.side * plane.normal.lpNorm<1>();
    const double here = plane.signedDistance(grid.centre(cell));
    const double reach = half_cell + 2.0 * band.at(grid.centre(cell).z());
    const Vector3 step = grid.side * plane.normal;
    const CellKey key = grid.table.key(cell);
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const double distance = here + dx * step[0] + dy * step[1] + dz * step[2];
          if (std::abs(distance) > reach) continue;
          const bool itself = dx == 0 && dy == 0 && dz == 0;
          const std::int32_t other = itself ? static_cast<std::int32_t>(cell)
                                            : grid.table.find({key.x + dx, key.y + dy, key.z + dz});
          if (other < 0) continue;
          addCandidate(candidates[static_cast<std::size_t>(other)], k);
        }
      }
    }
  }
  return candidates;
}

std::vector<PlaneEvidence> gatherEvidence(const PointsView& points, const Indices* indices,
                                          const PointCells& grid, const CellCandidates& candidates,
                                          const std::vector<Plane>& planes, const Vector3& origin,
                                          const MultiPlaneParams& params) {
  const DistanceBand band(params);
  std::vector<std::vector<PlaneEvidence>> parts((grid.cell_of.size() + kChunk - 1) / kChunk);
  for (std::vector<PlaneEvidence>& part : parts) part.resize(planes.size());
  const auto add = [&](std::size_t chunk, std::size_t i, const Nearest& nearest) {
    const float* p = points[i];
    const double threshold = band.at(p[2]);
    if (nearest.distance > 2.0 * threshold) return;
    PlaneEvidence& evidence = parts[chunk][static_cast<std::size_t>(nearest.plane)];
    if (nearest.distance > threshold) {
      (nearest.above ? evidence.above : evidence.below) += 1.0;
      return;
    }
    evidence.sums.add(p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]);
  };
  forEachNearest(points, indices, grid, candidates, planes, params.threads, add);
  std::vector<PlaneEvidence> all(planes.size());
  for (const std::vector<PlaneEvidence>& part : parts) {
    for (std::size_t k = 0; k < part.size(); ++k) {
      all[k].sums.add(part[k].sums, Vector3::Zero());
      all[k].above += part[k].above;
      all[k].below += part[k].below;
    }
  }
  return all;
}

std::vector<std::int32_t> labelPoints(const PointsView& points, const Indices* indices,
                                      const PointCells& grid, const CellCandidates& candidates,
                                      const std::vector<Plane>& planes,
                                      const MultiPlaneParams& params) {
  const DistanceBand band(params);
  std::vector<std::int32_t> labels(points.size, -1);
  const auto label = [&](std::size_t /*chunk*/, std::size_t i, const Nearest& nearest) {
    if (nearest.distance <= band.at(points[i][2])) labels[i] = nearest.plane;
  };
  forEachNearest(points, indices, grid, candidates, planes, params.threads, label);
  return labels;
}

}  // namespace planar_mapping::detail
