// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/tiles/organized_growing.h"

#include <algorithm>
#include <numeric>

namespace planar_mapping::detail {

namespace {

constexpr double kMinCellFraction = 0.3;  // of a cell that joins a plane as a whole

constexpr int kReach = 2;  ///< cells within which planes are adjacent: one between them is an edge

/// The planes that each plane is adjacent to.
std::vector<std::vector<std::int16_t>> adjacentPlanes(const std::vector<std::int16_t>& labels,
                                                      int columns, int rows, std::size_t planes) {
  std::vector<std::vector<std::int16_t>> adjacent(planes);
  std::int16_t last[2] = {-1, -1};  // borders are long
  const auto add = [&](std::int16_t plane, std::int16_t other) {
    std::vector<std::int16_t>& list = adjacent[static_cast<std::size_t>(plane)];
    if (std::find(list.begin(), list.end(), other) == list.end()) list.push_back(other);
  };
  for (int row = 0; row < rows; ++row) {
    const std::int16_t* line = labels.data() + static_cast<std::size_t>(row) * columns;
    const int below = std::min(kReach, rows - 1 - row);
    for (int column = 0; column < columns; ++column) {
      const std::int16_t label = line[column];
      if (label < 0) continue;
      for (int r = 0; r <= below; ++r) {
        const int left = r == 0 ? column + 1 : std::max(0, column - kReach);
        for (int c = left; c <= std::min(columns - 1, column + kReach); ++c) {
          const std::int16_t other = line[r * columns + c];
          if (other < 0 || other == label || (label == last[0] && other == last[1])) continue;
          last[0] = label;
          last[1] = other;
          add(label, other);
          add(other, label);
        }
      }
    }
  }
  return adjacent;
}

}  // namespace

double PlaneCandidate::meanSquare(const MomentSums& other) const {
  const double nx = normal[0];
  const double ny = normal[1];
  const double nz = normal[2];
  const double products =
      nx * nx * other[kXX] + ny * ny * other[kYY] + nz * nz * other[kZZ] +
      2.0 * (nx * ny * other[kXY] + nx * nz * other[kXZ] + ny * nz * other[kYZ]);
  const double along = nx * other[kX] + ny * other[kY] + nz * other[kZ];
  const double square = (products + 2.0 * offset * along) / other[kN] + offset * offset;
  return std::max(0.0, square);
}

CellGrower::CellGrower(const CellGrid& grid, const PlaneFit& fit)
    : grid_(grid), fit_(fit), visited_(static_cast<std::size_t>(grid.cells()), 0) {}

std::vector<std::pair<float, int>> CellGrower::seedOrder() const {
  // Widest planar window first, then smallest residual.
  std::vector<std::pair<float, int>> seeds;
  for (int cell = 0; cell < grid_.cells(); ++cell) {
    const CellState& state = states_[static_cast<std::size_t>(cell)];
    if (state.planarity == 0) continue;
    constexpr float kMaxResidual = 9.0F;  // less than between windows of different widths
    seeds.emplace_back(
        10.0F * static_cast<float>(3 - state.planarity) + std::min(kMaxResidual, state.residual),
        cell);
  }
  std::sort(seeds.begin(), seeds.end());
  return seeds;
}

void CellGrower::collect(int seed, PlaneCandidate plane, bool refit,
                         const std::vector<std::int16_t>& labels, std::vector<int>& cells,
                         MomentSums& sums) {
  constexpr double kRefitGrowth = 1.3;
  cells.clear();
  sums = {};
  ++visit_;
  cells.push_back(seed);
  visited_[static_cast<std::size_t>(seed)] = visit_;
  double refit_at = plane.sums[kN];
  for (std::size_t head = 0; head < cells.size(); ++head) {
    const int cell = cells[head];
    addSums(sums, sumsOf(grid_, cell));
    if (refit && sums[kN] > refit_at) {
      plane.sums = sums;
      fit_.fit(plane);
      if (!plane.valid) return;
      refit_at = kRefitGrowth * sums[kN];
    }
    const int column = cell % grid_.columns;
    const int neighbours[4] = {column > 0 ? cell - 1 : -1,
                               column + 1 < grid_.columns ? cell + 1 : -1, cell - grid_.columns,
                               cell + grid_.columns};
    for (const int next : neighbours) {
      if (next < 0 || next >= grid_.cells()) continue;
      const auto i = static_cast<std::size_t>(next);
      if (visited_[i] == visit_ || labels[i] >= 0) continue;
      visited_[i] = visit_;
      if (!(grid_.count(next) >= kMinCellFraction * grid_.capacity)) continue;
      if (accepts(plane, sumsOf(grid_, next), states_[i])) cells.push_back(next);
    }
  }
}

GrownCells CellGrower::grow(double min_points, std::vector<PlaneCandidate>& planes) {
  GrownCells grown;
  const auto cells = static_cast<std::size_t>(grid_.cells());
  grown.labels.assign(cells, -1);
  states_.assign(cells, CellState{});
  classify();
  std::vector<char> tried(cells, 0);
  std::vector<int> members;
  PlaneCandidate plane;
  for (const auto& [key, seed] : seedOrder()) {
    const auto s = static_cast<std::size_t>(seed);
    if (grown.labels[s] >= 0 || tried[s] != 0) continue;
    ++grown.seeds;
    plane.sums = sumWindow(grid_, seed, states_[s].planarity - 1);
    fit_.fit(plane);
    if (!plane.valid) continue;
    bool good = true;
    for (const bool refit : {true, false}) {
      MomentSums sums;
      collect(seed, plane, refit, grown.labels, members, sums);
      plane.sums = sums;
      fit_.fit(plane);
      good = plane.valid && static_cast<int>(members.size()) >= kMinCells && sums[kN] >= min_points;
      if (!good) break;
    }
    if (!good) {
      for (const int cell : members) tried[static_cast<std::size_t>(cell)] = 1;
      ++grown.too_small;
      continue;
    }
    if (planes.size() >= kMaxCandidates) break;
    for (const int cell : members) {
      grown.labels[static_cast<std::size_t>(cell)] = static_cast<std::int16_t>(planes.size());
    }
    planes.push_back(plane);
  }
  return grown;
}

std::vector<std::int16_t> mergeCandidates(std::vector<PlaneCandidate>& planes,
                                          const std::vector<std::int16_t>& labels, int columns,
                                          int rows, const PlaneFit& fit) {
  const std::size_t count = planes.size();
  std::vector<std::int16_t> target(count);
  std::iota(target.begin(), target.end(), std::int16_t{0});
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return planes[a].sums[kN] > planes[b].sums[kN] ||
           (planes[a].sums[kN] == planes[b].sums[kN] && a < b);
  });
  std::vector<std::vector<std::int16_t>> adjacent = adjacentPlanes(labels, columns, rows, count);
  const auto touches = [&](std::size_t small, std::size_t large) {
    return std::any_of(adjacent[small].begin(), adjacent[small].end(), [&](std::int16_t other) {
      return target[static_cast<std::size_t>(other)] == static_cast<std::int16_t>(large);
    });
  };
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t small = order[i];
    if (!planes[small].valid) continue;
    PlaneCandidate joined;
    const auto isOneWith = [&](std::size_t large) {
      return planes[large].valid && target[large] == static_cast<std::int16_t>(large) &&
             fit.areOne(planes[large], planes[small], touches(small, large), joined);
    };
    const auto found =
        std::find_if(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(i), isOneWith);
    if (found == order.begin() + static_cast<std::ptrdiff_t>(i)) continue;
    const std::size_t large = *found;
    planes[large] = joined;
    planes[small].valid = false;
    target[small] = static_cast<std::int16_t>(large);
    // What the small one was adjacent to is adjacent to the large one now.
    adjacent[large].insert(adjacent[large].end(), adjacent[small].begin(), adjacent[small].end());
  }
  return target;
}

}  // namespace planar_mapping::detail
