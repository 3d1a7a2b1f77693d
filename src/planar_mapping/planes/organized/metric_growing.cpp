// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "planar_mapping/planes/organized/metric_fit.h"

namespace planar_mapping::detail {

MetricGrower::MetricGrower(const CellGrid& grid, bool wide, const MetricFit& fit)
    : CellGrower(grid, fit),
      fit_(fit),
      least_noise_(fit.params().distance_threshold *
                   (wide ? fit.params().smallest_noise_fraction
                         : fit.params().smallest_quarter_noise_fraction)),
      fits_(fitCells(grid, fit.sensor())),
      window_fits_(fitCells(windowSums(grid, 1), fit.sensor())) {
  if (wide) wide_fits_ = fitCells(windowSums(grid, 2), fit.sensor());
}

RangeNoise MetricGrower::noise() const {
  return estimateNoise(grid_, fits_, window_fits_, fit_.sensor(), fit_.params());
}

void MetricGrower::classify() {
  constexpr double kMinFraction = 0.5;  // of a full window
  const OrganizedParams& params = fit_.params();
  const Vector3& sensor = fit_.sensor();
  const double correlated = fit_.noise().correlated_pixels;
  for (int cell = 0; cell < grid_.cells(); ++cell) {
    const auto i = static_cast<std::size_t>(cell);
    if (!(grid_.count(cell) >= 1.0)) continue;
    CellState& state = states_[i];
    const double squared_range = (meanOf(grid_, cell) - sensor).squaredNorm();
    if (!std::isfinite(squared_range)) continue;
    const double range = std::sqrt(squared_range);
    const double sigma = fit_.noise().at(squared_range);
    const double noise_over_range = range > 0.0 ? sigma / range : 0.0;
    state.noise_over_range = static_cast<float>(noise_over_range);
    const auto planar = [&](const CellFit& fit, int cells) {
      const double count = fit.count;
      if (!(count >= kMinFraction * cells * grid_.capacity)) return false;
      const double noise = noise_over_range * fit.height(sensor) + least_noise_;
      if (!(fit.residual <= params.planar_factor * noise) || !(fit.extent > 0.0F)) return false;
      state.residual = static_cast<float>(fit.residual / (noise_over_range * range + least_noise_));
      if (cells > 9) return true;  // of wide windows the width alone counts
      std::copy(fit.normal, fit.normal + 3, state.normal);
      const double independent = std::max(1.0, count / correlated);
      const double error = noise / (fit.extent * std::sqrt(independent));
      const double allowed = params.growing_angle_fraction * params.max_normal_deviation +
                             params.growing_factor * error;
      state.min_cosine = static_cast<float>(allowed < M_PI_2 ? std::cos(allowed) : 0.0);
      return true;
    };
    if (planar(fits_[i], 1)) state.planarity = 1;
    if (!planar(window_fits_[i], 9)) continue;
    state.planarity = !wide_fits_.empty() && planar(wide_fits_[i], 25) ? 3 : 2;
  }
}

bool MetricGrower::accepts(const PlaneCandidate& plane, const MomentSums& sums,
                           const CellState& state) const {
  const OrganizedParams& params = fit_.params();
  const double inverse = 1.0 / sums[kN];
  const Vector3 mean(sums[kX] * inverse, sums[kY] * inverse, sums[kZ] * inverse);
  const double distance = plane.distance(mean);
  const double noise = state.noise_over_range * std::fabs(distance - plane.height);
  const double noise_of_mean =
      noise * std::sqrt(std::min(1.0, fit_.noise().correlated_pixels * inverse));
  const double allowed = std::min(std::max(params.growingDistance(), params.growing_factor * noise),
                                  params.flatDistance() + params.growing_factor * noise_of_mean);
  if (!(std::fabs(distance) <= allowed)) return false;
  const double spread = params.planar_factor * noise;
  if (!(plane.meanSquare(sums) <= allowed * allowed + spread * spread)) return false;
  return state.planarity == 0 || plane.cosine(state.normal) >= state.min_cosine;
}

}  // namespace planar_mapping::detail
