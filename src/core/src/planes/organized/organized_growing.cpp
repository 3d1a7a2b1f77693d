// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/organized/organized_growing.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "planes/organized/organized_folds.h"

namespace planar_mapping::detail {
namespace {

/// Whether two planes have cells that touch or have one cell between them, which may be an edge.
/// \param target plane per label
bool touch(const CellLabels& cells, const std::vector<std::int16_t>& target, std::int16_t one,
           std::int16_t other) {
  constexpr int kReach = 2;
  const auto holds = [&](int row, int column, std::int16_t plane) {
    const std::int16_t label = cells.labels[static_cast<std::size_t>(row) * cells.columns + column];
    return label >= 0 && target[static_cast<std::size_t>(label)] == plane;
  };
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.columns; ++column) {
      if (!holds(row, column, one)) continue;
      const int bottom = std::min(cells.rows - 1, row + kReach);
      const int right = std::min(cells.columns - 1, column + kReach);
      for (int r = std::max(0, row - kReach); r <= bottom; ++r) {
        for (int c = std::max(0, column - kReach); c <= right; ++c) {
          if (holds(r, c, other)) return true;
        }
      }
    }
  }
  return false;
}

}  // namespace

void addSums(MomentSums& sums, const CellGrid& grid, int cell) {
  for (int m = 0; m < kMoments; ++m) sums[static_cast<std::size_t>(m)] += grid.moment(m)[cell];
}

void PlaneCandidate::fit(const Vector3& sensor) {
  const CellFit found = fitSums(sums, sensor);
  const Vector3 n(found.normal[0], found.normal[1], found.normal[2]);
  const double length = n.norm();
  valid = length > 0.5 && found.extent > 0.0F && std::isfinite(length);
  if (!valid) return;
  for (int i = 0; i < 3; ++i) normal[i] = n[i] / length;
  offset = -(normal[0] * sums[kX] + normal[1] * sums[kY] + normal[2] * sums[kZ]) / sums[kN];
  residual = found.residual;
  width = found.extent;
}

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

CellGrower::CellGrower(const CellGrid& grid, bool wide, double* room, const Vector3& sensor,
                       const OrganizedParams& params)
    : grid_(grid),
      sensor_(sensor),
      params_(params),
      least_noise_(params.distance_threshold *
                   (wide ? params.smallest_noise_share : params.smallest_quarter_noise_share)),
      fits_(fitCells(grid, sensor)),
      visited_(static_cast<std::size_t>(grid.cells()), 0) {
  window_fits_ = fitCells(windowSums(grid, 1, room), sensor);
  if (wide) wide_fits_ = fitCells(windowSums(grid, 2, room), sensor);
}

void CellGrower::estimateNoise() {
  constexpr int kWindowCells = 9;
  // Small windows tell white noise best, wide ones that which is smooth over many pixels.
  const RangeNoise white = detail::estimateNoise(fits_, grid_.capacity, sensor_, params_);
  noise_ = detail::estimateNoise(window_fits_, kWindowCells * grid_.capacity, sensor_, params_);
  const double correlated = correlatedPixels(grid_, window_fits_, white, sensor_, params_);
  if (correlated <= params_.white_correlation) {
    noise_ = white;
    noise_.correlated_pixels = correlated;
  } else {
    noise_.correlated_pixels = correlatedPixels(grid_, window_fits_, noise_, sensor_, params_);
  }
}

void CellGrower::classify() {
  constexpr double kMinShare = 0.5;  // of a full window
  states_.assign(static_cast<std::size_t>(grid_.cells()), CellState{});
  const auto planar = [&](const CellFit& fit, int cells, double noise_over_range,
                          CellState& state) {
    const double count = fit.count;
    if (!(count >= kMinShare * cells * grid_.capacity)) return false;
    const double along = std::fabs(fit.normal[0] * (fit.mean[0] - sensor_.x()) +
                                   fit.normal[1] * (fit.mean[1] - sensor_.y()) +
                                   fit.normal[2] * (fit.mean[2] - sensor_.z()));
    const double noise = noise_over_range * along + least_noise_;
    if (!(fit.residual <= params_.planar_factor * noise) || !(fit.extent > 0.0F)) return false;
    std::copy(fit.normal, fit.normal + 3, state.normal);
    const double independent = std::max(1.0, count / noise_.correlated_pixels);
    const double error = noise / (fit.extent * std::sqrt(independent));
    const double allowed =
        params_.growing_angle_share * params_.max_normal_deviation + params_.growing_factor * error;
    state.min_cosine = static_cast<float>(allowed < M_PI_2 ? std::cos(allowed) : 0.0);
    return true;
  };
  for (int cell = 0; cell < grid_.cells(); ++cell) {
    const auto i = static_cast<std::size_t>(cell);
    const double n = grid_.count(cell);
    if (!(n >= 1.0)) continue;
    CellState& state = states_[i];
    const double inverse = 1.0 / n;
    const double dx = grid_.moment(kX)[cell] * inverse - sensor_.x();
    const double dy = grid_.moment(kY)[cell] * inverse - sensor_.y();
    const double dz = grid_.moment(kZ)[cell] * inverse - sensor_.z();
    const double squared_range = dx * dx + dy * dy + dz * dz;
    if (!std::isfinite(squared_range)) continue;
    const double range = std::sqrt(squared_range);
    state.squared_range = static_cast<float>(squared_range);
    const double noise_over_range = range > 0.0 ? noise_.at(squared_range) / range : 0.0;
    state.noise_over_range = static_cast<float>(noise_over_range);
    if (planar(fits_[i], 1, noise_over_range, state)) state.planarity = 1;
    if (planar(window_fits_[i], 9, noise_over_range, state)) {
      state.planarity = 2;
      CellState wide = state;
      if (!wide_fits_.empty() && planar(wide_fits_[i], 25, noise_over_range, wide)) {
        state.planarity = 3;
      }
    }
  }
}

std::vector<int> CellGrower::seedOrder() const {
  // Widest planar window first, then smallest residual in units of the noise.
  struct Seed {
    float key;
    int cell;
  };
  std::vector<Seed> seeds;
  for (int cell = 0; cell < grid_.cells(); ++cell) {
    const auto i = static_cast<std::size_t>(cell);
    const CellState& state = states_[i];
    if (state.planarity == 0) continue;
    const CellFit& fit =
        state.planarity == 3 ? wide_fits_[i] : (state.planarity == 2 ? window_fits_[i] : fits_[i]);
    const double noise = state.noise_over_range * std::sqrt(state.squared_range) + least_noise_;
    const double relative = std::min(9.0, fit.residual / noise);
    seeds.push_back({static_cast<float>(10.0 * (3 - state.planarity) + relative), cell});
  }
  std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) {
    return a.key < b.key || (a.key == b.key && a.cell < b.cell);
  });
  std::vector<int> order;
  order.reserve(seeds.size());
  for (const Seed& seed : seeds) order.push_back(seed.cell);
  return order;
}

PlaneCandidate CellGrower::seedPlane(int cell) const {
  const int radius = states_[static_cast<std::size_t>(cell)].planarity - 1;
  const int row = cell / grid_.columns;
  const int column = cell % grid_.columns;
  PlaneCandidate plane;
  for (int r = std::max(0, row - radius); r <= std::min(grid_.rows - 1, row + radius); ++r) {
    for (int c = std::max(0, column - radius); c <= std::min(grid_.columns - 1, column + radius);
         ++c) {
      addSums(plane.sums, grid_, r * grid_.columns + c);
    }
  }
  plane.fit(sensor_);
  return plane;
}

bool CellGrower::accepts(const PlaneCandidate& plane, double sensor_distance, int cell) const {
  const auto i = static_cast<std::size_t>(cell);
  const CellState& state = states_[i];
  const double n = grid_.count(cell);
  if (!(n >= params_.min_cell_share * grid_.capacity)) return false;
  const double inverse = 1.0 / n;
  const double mean[3] = {grid_.moment(kX)[cell] * inverse, grid_.moment(kY)[cell] * inverse,
                          grid_.moment(kZ)[cell] * inverse};
  const double distance = plane.distance(mean);
  const double noise = state.noise_over_range * std::fabs(distance - sensor_distance);
  const double noise_of_mean = noise * std::sqrt(std::min(1.0, noise_.correlated_pixels * inverse));
  const double allowed = std::min(
      std::max(params_.growing_share * params_.distance_threshold, params_.growing_factor * noise),
      params_.flat_share * params_.distance_threshold + params_.growing_factor * noise_of_mean);
  if (!(std::fabs(distance) <= allowed)) return false;
  const double spread = params_.planar_factor * noise;
  MomentSums sums;
  for (int m = 0; m < kMoments; ++m) sums[static_cast<std::size_t>(m)] = grid_.moment(m)[cell];
  if (!(plane.meanSquare(sums) <= allowed * allowed + spread * spread)) return false;
  if (state.planarity == 0) return true;
  const double cosine =
      std::fabs(plane.normal[0] * state.normal[0] + plane.normal[1] * state.normal[1] +
                plane.normal[2] * state.normal[2]);
  return cosine >= state.min_cosine;
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
  double sensor_distance = plane.distance(sensor_.data());
  for (std::size_t head = 0; head < cells.size(); ++head) {
    const int cell = cells[head];
    addSums(sums, grid_, cell);
    if (refit && sums[kN] > refit_at) {
      plane.sums = sums;
      plane.fit(sensor_);
      if (!plane.valid) return;
      sensor_distance = plane.distance(sensor_.data());
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
      if (accepts(plane, sensor_distance, next)) cells.push_back(next);
    }
  }
}

GrownCells CellGrower::grow(std::vector<PlaneCandidate>& planes) {
  GrownCells grown;
  const auto cells = static_cast<std::size_t>(grid_.cells());
  grown.labels.assign(cells, -1);
  classify();
  std::vector<char> tried(cells, 0);
  std::vector<int> members;
  PlaneCandidate plane;
  const double min_points = params_.min_seed_share * params_.min_inliers;
  for (const int seed : seedOrder()) {
    const auto s = static_cast<std::size_t>(seed);
    if (grown.labels[s] >= 0 || tried[s]) continue;
    ++grown.seeds;
    plane = seedPlane(seed);
    if (!plane.valid) continue;
    bool good = true;
    for (const bool refit : {true, false}) {
      MomentSums sums;
      collect(seed, plane, refit, grown.labels, members, sums);
      plane.sums = sums;
      plane.fit(sensor_);
      good = plane.valid && static_cast<int>(members.size()) >= params_.min_cells &&
             sums[kN] >= min_points;
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
                                          const CellLabels& cells, const RangeNoise& noise,
                                          const Vector3& sensor, const OrganizedParams& params) {
  const std::size_t count = planes.size();
  std::vector<std::int16_t> target(count);
  std::iota(target.begin(), target.end(), std::int16_t{0});
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return planes[a].sums[kN] > planes[b].sums[kN] ||
           (planes[a].sums[kN] == planes[b].sums[kN] && a < b);
  });
  const auto tolerance = [&](const PlaneCandidate& plane, double flat_share) {
    const double n = plane.sums[kN];
    const Vector3 mean(plane.sums[kX] / n, plane.sums[kY] / n, plane.sums[kZ] / n);
    const double sigma = noise.at((mean - sensor).squaredNorm());
    return std::max(flat_share * params.distance_threshold, params.merging_factor * sigma);
  };
  const double bent_share = params.merging_factor * params.growing_share;
  const double min_cosine = std::cos(params.merging_angle);
  const double min_cosine_between = std::cos(2.0 * params.merging_angle);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const std::size_t large = order[j];
      const std::size_t small = order[i];
      if (!planes[large].valid || !planes[small].valid) continue;
      if (target[large] != static_cast<std::int16_t>(large)) continue;
      const double between = std::fabs(planes[large].normal[0] * planes[small].normal[0] +
                                       planes[large].normal[1] * planes[small].normal[1] +
                                       planes[large].normal[2] * planes[small].normal[2]);
      if (between < min_cosine_between) continue;
      PlaneCandidate joined;
      joined.sums = planes[large].sums;
      addSums(joined.sums, planes[small].sums);
      joined.fit(sensor);
      if (!joined.valid) continue;
      // One plane if neither part fits it much worse than its own plane.
      const auto worse = [&](const PlaneCandidate& part, double flat_share) {
        const double cosine =
            std::fabs(joined.normal[0] * part.normal[0] + joined.normal[1] * part.normal[1] +
                      joined.normal[2] * part.normal[2]);
        if (cosine < min_cosine) return true;
        const double excess = joined.meanSquare(part.sums) - part.residual * part.residual;
        const double allowed = tolerance(part, flat_share);
        return !(excess <= allowed * allowed);
      };
      if (worse(planes[large], bent_share) || worse(planes[small], bent_share)) continue;
      if (isFold(planes[large], planes[small], joined, noise, sensor, params)) continue;
      const bool bent =
          worse(planes[large], params.flat_share) || worse(planes[small], params.flat_share);
      if (bent && !touch(cells, target, static_cast<std::int16_t>(small),
                         static_cast<std::int16_t>(large))) {
        continue;
      }
      planes[large] = joined;
      target[small] = static_cast<std::int16_t>(large);
      break;
    }
  }
  return target;
}

}  // namespace planar_mapping::detail
