// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/disparity/disparity_growing.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "planes/organized/organized_growing.h"
#include "planar_mapping/core/base/detail/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr int kWindowCells[3] = {1, 9, 25};
constexpr double kLeastNoise = 1e-6;  ///< pixels
constexpr double kMinShare = 0.5;     ///< of a full window, for it to be planar
constexpr unsigned kAlone = 1;
constexpr unsigned kTogether = 2;

double cosineBetween(const double* a, const float* b) {
  return std::fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

double cosineBetween(const double* a, const double* b) {
  return std::fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

constexpr int kReach = 2;  ///< cells within which planes are adjacent

/// 1 where a labelled cell of a row has another label within reach beside it or in the \p below
/// rows that follow: so few that looking at them one by one takes no time.
PLANAR_MAPPING_MULTIVERSION
void markBorders(const std::int16_t* line, int columns, int below, std::uint8_t* meets) {
  for (int c = 0; c < columns; ++c) meets[c] = 0;
  for (int r = 0; r <= below; ++r) {
    for (int shift = r == 0 ? 1 : -kReach; shift <= kReach; ++shift) {
      const std::int16_t* other = line + r * columns + shift;
      const int first = shift < 0 ? -shift : 0;
      const int last = shift > 0 ? columns - shift : columns;
      for (int c = first; c < last; ++c) {
        meets[c] |= (line[c] >= 0) & (other[c] >= 0) & (line[c] != other[c]) ? 1 : 0;
      }
    }
  }
}

}  // namespace

DisparityGrower::DisparityGrower(const CellGrid& grid, double* room)
    : grid_(grid), visited_(static_cast<std::size_t>(grid.cells()), 0) {
  const auto occupied = std::count_if(grid.moment(kN), grid.moment(kN) + grid.cells(),
                                      [](double count) { return count > 0.0; });
  // Where most cells are empty, windows are fitted one by one where there are enough points.
  if (2 * occupied < grid.cells()) return;
  fits_[0] = fitDisparities(windowSums(grid, 1, room));
  fits_[1] = fitDisparities(windowSums(grid, 2, room));
}

DisparityFit DisparityGrower::fitWindow(int cell, int radius) const {
  const int row = cell / grid_.columns;
  const int column = cell % grid_.columns;
  const int top = std::max(0, row - radius);
  const int bottom = std::min(grid_.rows - 1, row + radius);
  const int left = std::max(0, column - radius);
  const int right = std::min(grid_.columns - 1, column + radius);
  MomentSums sums;
  for (int m = 0; m < kMoments; ++m) {
    const double* line = grid_.moment(m) + static_cast<std::size_t>(top) * grid_.columns;
    double window = 0.0;
    for (int c = left; c <= right; ++c) {
      double sum = line[c];
      for (int r = 1; r <= bottom - top; ++r) sum += line[r * grid_.columns + c];
      window += sum;
    }
    sums[static_cast<std::size_t>(m)] = window;
  }
  return fitDisparity(sums);
}

std::vector<std::uint8_t> DisparityGrower::findFilled() const {
  std::vector<std::uint8_t> filled(visited_.size());
  const double* counts = grid_.moment(kN);
  const int columns = grid_.columns;
  const double alone = kMinShare * grid_.capacity;
  const double together = kMinShare * kWindowCells[1] * grid_.capacity;
  std::vector<double> sums(static_cast<std::size_t>(columns) + 2, 0.0);  // of three rows
  for (int row = 0; row < grid_.rows; ++row) {
    const double* line = counts + static_cast<std::size_t>(row) * columns;
    const double* above = row > 0 ? line - columns : nullptr;
    const double* below = row + 1 < grid_.rows ? line + columns : nullptr;
    for (int c = 0; c < columns; ++c) {
      sums[static_cast<std::size_t>(c) + 1] =
          line[c] + (above != nullptr ? above[c] : 0.0) + (below != nullptr ? below[c] : 0.0);
    }
    std::uint8_t* out = filled.data() + static_cast<std::size_t>(row) * columns;
    for (int c = 0; c < columns; ++c) {
      const double around = sums[static_cast<std::size_t>(c)] +
                            sums[static_cast<std::size_t>(c) + 1] +
                            sums[static_cast<std::size_t>(c) + 2];
      out[c] = static_cast<std::uint8_t>((line[c] >= alone ? kAlone : 0) |
                                         (around >= together ? kTogether : 0));
    }
  }
  return filled;
}

double DisparityGrower::estimateNoise(const DisparityParams& params) {
  if (fits_[0].empty()) {
    fits_[0].resize(visited_.size());
    const std::vector<std::uint8_t> filled = findFilled();
    for (int cell = 0; cell < grid_.cells(); ++cell) {
      const auto i = static_cast<std::size_t>(cell);
      if ((filled[i] & kTogether) != 0) fits_[0][i] = fitWindow(cell, 1);
    }
  }
  return estimateDisparityNoise(fits_[0], kWindowCells[1] * grid_.capacity, params);
}

void DisparityGrower::classify(const DisparityParams& params) {
  states_.assign(static_cast<std::size_t>(grid_.cells()), State{});
  const auto planar = [&](const DisparityFit& fit, int cells, State& state) {
    const double count = fit.count;
    if (!(count >= kMinShare * cells * grid_.capacity)) return false;
    double normal[3];
    double height = 0.0;
    metricPlane(fit.p, fit.q, fit.d - fit.p * fit.x - fit.q * fit.y, params, normal, height);
    const double flat = params.planar_share * params.distance_threshold * fit.d / height;
    const double noise = std::max(params.planar_factor * params.noise,
                                  params.smooth_residual_share * params.camera.disparity_error);
    if (!(fit.residual <= std::max(noise, flat))) return false;
    // How far noise turns the normal: slopes err by this, and a slope turns the plane by h cos / B.
    const double f = params.camera.focal_length;
    const double range =
        params.factor() / fit.d *
        std::sqrt(1.0 + (static_cast<double>(fit.x) * fit.x + static_cast<double>(fit.y) * fit.y) /
                            (f * f));
    const double error =
        params.slopeError(fit.extent, count) * height * (height / range) / params.camera.baseline;
    const double allowed =
        params.growing_angle_share * params.max_normal_deviation + params.growing_factor * error;
    for (int axis = 0; axis < 3; ++axis) state.normal[axis] = static_cast<float>(normal[axis]);
    state.min_cosine = static_cast<float>(allowed < M_PI_2 ? std::cos(allowed) : 0.0);
    state.residual = fit.residual;
    return true;
  };
  const std::vector<std::uint8_t> filled = findFilled();
  for (int cell = 0; cell < grid_.cells(); ++cell) {
    const auto i = static_cast<std::size_t>(cell);
    if (filled[i] == 0) continue;
    const auto fitOf = [&](int radius) {
      const bool is_known = radius > 0 && !fits_[radius - 1].empty();
      return is_known ? fits_[radius - 1][i] : fitWindow(cell, radius);
    };
    State& state = states_[i];
    if ((filled[i] & kTogether) != 0 && planar(fitOf(1), kWindowCells[1], state)) {
      state.planarity = 2;
      State wide = state;
      if (planar(fitOf(2), kWindowCells[2], wide)) {
        state.planarity = 3;
        state.residual = wide.residual;
      }
    } else if ((filled[i] & kAlone) != 0 && planar(fitOf(0), kWindowCells[0], state)) {
      state.planarity = 1;
    }
  }
}

std::vector<int> DisparityGrower::seedOrder(const DisparityParams& params) const {
  // Widest planar window first, then smallest residual in units of the noise.
  struct Seed {
    float key;
    int cell;
  };
  std::vector<Seed> seeds;
  for (int cell = 0; cell < grid_.cells(); ++cell) {
    const auto i = static_cast<std::size_t>(cell);
    const int planarity = states_[i].planarity;
    if (planarity == 0) continue;
    const double relative =
        std::min(9.0, states_[i].residual / std::max(params.noise, kLeastNoise));
    seeds.push_back({static_cast<float>(10.0 * (3 - planarity) + relative), cell});
  }
  std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) {
    return a.key < b.key || (a.key == b.key && a.cell < b.cell);
  });
  std::vector<int> order;
  order.reserve(seeds.size());
  for (const Seed& seed : seeds) order.push_back(seed.cell);
  return order;
}

DisparityPlane DisparityGrower::seedPlane(int cell, const DisparityParams& params) const {
  const int radius = states_[static_cast<std::size_t>(cell)].planarity - 1;
  const int row = cell / grid_.columns;
  const int column = cell % grid_.columns;
  DisparityPlane plane;
  for (int r = std::max(0, row - radius); r <= std::min(grid_.rows - 1, row + radius); ++r) {
    for (int c = std::max(0, column - radius); c <= std::min(grid_.columns - 1, column + radius);
         ++c) {
      addSums(plane.sums, grid_, r * grid_.columns + c);
    }
  }
  plane.fit(params);
  return plane;
}

bool DisparityGrower::accepts(const DisparityPlane& plane, int cell,
                              const DisparityParams& params) const {
  const double n = grid_.count(cell);
  if (!(n >= params.min_cell_share * grid_.capacity)) return false;
  MomentSums sums;
  for (int m = 0; m < kMoments; ++m) sums[static_cast<std::size_t>(m)] = grid_.moment(m)[cell];
  const double allowed =
      std::max(plane.pixels(params.growing_share * params.distance_threshold, sums[kZ] / n),
               params.tolerance(params.growing_factor));
  if (!(std::fabs(plane.meanError(sums)) <= allowed)) return false;
  if (!(plane.meanSquare(sums) <= allowed * allowed)) return false;
  const State& state = states_[static_cast<std::size_t>(cell)];
  return state.planarity == 0 || cosineBetween(plane.normal, state.normal) >= state.min_cosine;
}

void DisparityGrower::collect(int seed, DisparityPlane plane, bool refit,
                              const DisparityParams& params,
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
    addSums(sums, grid_, cell);
    if (refit && sums[kN] > refit_at) {
      plane.sums = sums;
      plane.fit(params);
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
      if (accepts(plane, next, params)) cells.push_back(next);
    }
  }
}

DisparityRegions DisparityGrower::grow(const DisparityParams& params,
                                       std::vector<DisparityPlane>& planes) {
  DisparityRegions grown;
  const auto cells = static_cast<std::size_t>(grid_.cells());
  grown.labels.assign(cells, -1);
  classify(params);
  std::vector<char> tried(cells, 0);
  std::vector<int> members;
  const double min_points = params.min_seed_share * params.min_inliers;
  for (const int seed : seedOrder(params)) {
    const auto s = static_cast<std::size_t>(seed);
    if (grown.labels[s] >= 0 || tried[s] != 0) continue;
    ++grown.seeds;
    DisparityPlane plane = seedPlane(seed, params);
    bool good = plane.valid;
    for (const bool refit : {true, false}) {
      if (!good) break;
      MomentSums sums;
      collect(seed, plane, refit, params, grown.labels, members, sums);
      plane.sums = sums;
      plane.fit(params);
      good = plane.valid && static_cast<int>(members.size()) >= params.min_cells &&
             sums[kN] >= min_points;
    }
    if (!good) {
      for (const int cell : members) tried[static_cast<std::size_t>(cell)] = 1;
      tried[s] = 1;
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

PlanePairs adjacentPlanes(const std::vector<std::int16_t>& labels, int columns, int rows) {
  PlanePairs pairs;
  std::vector<std::uint8_t> meets(static_cast<std::size_t>(columns));
  for (int row = 0; row < rows; ++row) {
    const std::int16_t* line = labels.data() + static_cast<std::size_t>(row) * columns;
    const int below = std::min(kReach, rows - 1 - row);
    markBorders(line, columns, below, meets.data());
    for (int column = 0; column < columns; ++column) {
      if (meets[static_cast<std::size_t>(column)] == 0) continue;
      const std::int16_t label = line[column];
      for (int r = 0; r <= below; ++r) {
        const int left = r == 0 ? column + 1 : std::max(0, column - kReach);
        for (int c = left; c <= std::min(columns - 1, column + kReach); ++c) {
          const std::int16_t other = line[r * columns + c];
          if (other < 0 || other == label) continue;
          const std::pair<std::int16_t, std::int16_t> pair = std::minmax(label, other);
          if (pairs.empty() || pairs.back() != pair) pairs.push_back(pair);
        }
      }
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

std::vector<std::int16_t> mergePlanes(std::vector<DisparityPlane>& planes, const PlanePairs& pairs,
                                      const DisparityParams& params) {
  const std::size_t count = planes.size();
  std::vector<std::int16_t> target(count);
  std::iota(target.begin(), target.end(), std::int16_t{0});
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return planes[a].sums[kN] > planes[b].sums[kN] ||
           (planes[a].sums[kN] == planes[b].sums[kN] && a < b);
  });
  // Planes a plane touches, and those it has become.
  std::vector<std::vector<std::int16_t>> touched(count);
  for (const auto& [a, b] : pairs) {
    touched[static_cast<std::size_t>(a)].push_back(b);
    touched[static_cast<std::size_t>(b)].push_back(a);
  }
  const auto touches = [&](std::size_t small, std::size_t large) {
    return std::any_of(touched[small].begin(), touched[small].end(), [&](std::int16_t other) {
      return target[static_cast<std::size_t>(other)] == static_cast<std::int16_t>(large);
    });
  };
  const double min_cosine = std::cos(params.merging_angle);
  const double flat = params.merging_factor * params.growing_share * params.distance_threshold;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t small = order[i];
    if (!planes[small].valid) continue;
    double best = 1.0;  // excess in units of what is allowed
    std::size_t best_large = count;
    DisparityPlane best_joined;
    for (std::size_t j = 0; j < i; ++j) {
      const std::size_t large = order[j];
      if (!planes[large].valid || target[large] != static_cast<std::int16_t>(large)) continue;
      const bool adjacent = touches(small, large);
      DisparityPlane joined;
      joined.sums = planes[large].sums;
      addSums(joined.sums, planes[small].sums);
      joined.fit(params);
      if (!joined.valid) continue;
      // One plane if neither part fits it much worse than its own plane and lies as it does, in
      // touching parts as far as the noise lets one see.
      const double noise_factor =
          adjacent ? params.merging_adjacent_factor : params.merging_apart_factor;
      const auto excessOf = [&](const DisparityPlane& part) {
        constexpr double kTooMuch = 2.0;
        const DisparityFit own = fitDisparity(part.sums);
        const double turn = std::hypot(joined.p - part.p, joined.q - part.q);
        if (cosineBetween(joined.normal, part.normal) < min_cosine &&
            !(adjacent &&
              turn <= params.growing_factor * params.slopeError(own.extent, own.count))) {
          return kTooMuch;
        }
        const double allowed =
            std::max(joined.pixels(flat, own.d), noise_factor * params.tolerance(1.0));
        const double excess = joined.meanSquare(part.sums) - part.residual * part.residual;
        return std::isfinite(excess) ? excess / (allowed * allowed) : kTooMuch;
      };
      const double excess = std::max(excessOf(planes[large]), excessOf(planes[small]));
      if (!(excess < best)) continue;
      best = excess;
      best_large = large;
      best_joined = joined;
    }
    if (best_large == count) continue;
    planes[best_large] = best_joined;
    target[small] = static_cast<std::int16_t>(best_large);
    // Parts that touched the small one touch the large one now.
    touched[best_large].insert(touched[best_large].end(), touched[small].begin(),
                               touched[small].end());
  }
  return target;
}

}  // namespace planar_mapping::detail
