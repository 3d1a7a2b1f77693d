// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstring>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/simd.h"
#include "planar_mapping/planes/disparity/disparity_fit.h"

namespace planar_mapping::detail {
namespace {

constexpr int kWindowCells[3] = {1, 9, 25};
constexpr double kMinNoise = 1e-6;    ///< pixels
constexpr double kMinFraction = 0.5;  ///< of a full window, for it to be planar
constexpr unsigned kAlone = 1;
constexpr unsigned kTogether = 2;
constexpr float kFar = 3e38F;

/// A plane as the pixel loop wants it; its band is max(constant, relative * D).
struct BandedDisparity {
  float p, q, r;
  float constant, relative;
  std::int16_t label;
};

// Each pixel to the plane nearest in disparity whose band it lies in.
PLANAR_MAPPING_MULTIVERSION
void nearestDisparity(const float* x, const BandedDisparity* planes, int count,
                      std::int16_t* labels) {
  const FloatLanes zero = {};
  for (int k = 0; k < kTileArea; k += kLanes) {
    FloatLanes px, py, pd;
    load(x + k, px, py, pd);
    IntLanes label = IntLanes{} - 1;
    FloatLanes best = zero + kFar;
    for (int plane = 0; plane < count; ++plane) {
      const BandedDisparity& b = planes[plane];
      const FloatLanes error = pd - (b.p * px + b.q * py + b.r);
      const FloatLanes distance = error < 0.0F ? -error : error;
      const FloatLanes relative = b.relative * pd;
      const FloatLanes constant = zero + b.constant;
      const FloatLanes band = relative > constant ? relative : constant;
      // Comparisons with NaN are false: pixels without a point stay free.
      const FloatLanes score = distance <= band ? distance : zero + kFar;
      label = score < best ? IntLanes{} + b.label : label;
      best = score < best ? score : best;
    }
    store(label, labels + k);
  }
}

}  // namespace

DisparityGrower::DisparityGrower(const CellGrid& grid, const DisparityFit& fit)
    : CellGrower(grid, fit), fit_(fit) {
  const auto occupied = std::count_if(grid.moment(kN), grid.moment(kN) + grid.cells(),
                                      [](double count) { return count > 0.0; });
  // Where most cells are empty, windows are fitted one by one where there are enough points.
  if (2 * occupied < grid.cells()) return;
  fits_[0] = fitDisparities(windowSums(grid, 1));
  fits_[1] = fitDisparities(windowSums(grid, 2));
}

std::vector<std::uint8_t> DisparityGrower::findFilled() const {
  std::vector<std::uint8_t> filled(static_cast<std::size_t>(grid_.cells()));
  const double alone = kMinFraction * grid_.capacity;
  const double together = kMinFraction * kWindowCells[1] * grid_.capacity;
  const CellGrid around = windowSums(grid_, 1, kN + 1);
  for (int cell = 0; cell < grid_.cells(); ++cell) {
    filled[static_cast<std::size_t>(cell)] =
        static_cast<std::uint8_t>((grid_.count(cell) >= alone ? kAlone : 0) |
                                  (around.count(cell) >= together ? kTogether : 0));
  }
  return filled;
}

double DisparityGrower::noise() {
  constexpr std::size_t kMinSamples = 20;
  const DisparityParams& params = fit_.params();
  const double least = params.min_noise_fraction * params.camera.disparity_error;
  const double most = params.camera.disparity_error;
  const std::vector<std::uint8_t> filled = findFilled();
  std::vector<double> residuals;
  for (int cell = 0; cell < grid_.cells(); ++cell) {
    const auto i = static_cast<std::size_t>(cell);
    if ((filled[i] & kTogether) == 0) continue;
    const DisparityWindow fit =
        fits_[0].empty() ? fitDisparity(sumWindow(grid_, cell, 1)) : fits_[0][i];
    if (fit.count > 0.0) residuals.push_back(fit.residual);
  }
  if (residuals.size() < kMinSamples) return most;
  const double place = params.noise_quantile * static_cast<double>(residuals.size() - 1);
  return std::clamp(ranked(residuals, static_cast<std::size_t>(place)), least, most);
}

void DisparityGrower::classify() {
  const DisparityParams& params = fit_.params();
  const auto planar = [&](const DisparityWindow& fit, int cells, CellState& state) {
    const double count = fit.count;
    if (!(count >= kMinFraction * cells * grid_.capacity)) return false;
    Vector3 normal;
    double height = 0.0;
    fit_.toMetres(fit.p, fit.q, fit.d - fit.p * fit.x - fit.q * fit.y, normal, height);
    const double flat = params.flatDistance() * fit.d / height;
    const double noise = std::max(params.planar_factor * params.noise, params.smoothResidual());
    if (!(fit.residual <= std::max(noise, flat))) return false;
    const double error =
        fit_.toAngle(params.slopeError(fit.extent, count), height, fit.x, fit.y, fit.d);
    const double allowed =
        params.growing_angle_fraction * params.max_normal_deviation + params.growing_factor * error;
    for (int axis = 0; axis < 3; ++axis) state.normal[axis] = static_cast<float>(normal[axis]);
    state.min_cosine = static_cast<float>(allowed < M_PI_2 ? std::cos(allowed) : 0.0);
    state.residual = static_cast<float>(fit.residual / std::max(params.noise, kMinNoise));
    return true;
  };
  const std::vector<std::uint8_t> filled = findFilled();
  for (int cell = 0; cell < grid_.cells(); ++cell) {
    const auto i = static_cast<std::size_t>(cell);
    if (filled[i] == 0) continue;
    const auto fitOf = [&](int radius) {
      const bool is_known = radius > 0 && !fits_[radius - 1].empty();
      return is_known ? fits_[radius - 1][i] : fitDisparity(sumWindow(grid_, cell, radius));
    };
    CellState& state = states_[i];
    if ((filled[i] & kTogether) != 0 && planar(fitOf(1), kWindowCells[1], state)) {
      state.planarity = 2;
      CellState wide = state;
      if (planar(fitOf(2), kWindowCells[2], wide)) {
        state.planarity = 3;
        state.residual = wide.residual;
      }
    } else if ((filled[i] & kAlone) != 0 && planar(fitOf(0), kWindowCells[0], state)) {
      state.planarity = 1;
    }
  }
}

bool DisparityGrower::accepts(const PlaneCandidate& plane, const MomentSums& sums,
                              const CellState& state) const {
  const DisparityParams& params = fit_.params();
  const double allowed =
      std::max(DisparityFit::toPixels(plane, params.growingDistance(), sums[kZ] / sums[kN]),
               params.tolerance(params.growing_factor));
  if (!(std::fabs(plane.meanError(sums)) <= allowed)) return false;
  if (!(plane.meanSquare(sums) <= allowed * allowed)) return false;
  return state.planarity == 0 || plane.cosine(state.normal) >= state.min_cosine;
}

void DisparityAssigner::assign(const std::vector<PlaneCandidate>& planes,
                               const DisparityParams& params, double fraction, double sigmas) {
  parallelFor(static_cast<std::size_t>(cloud_.rows), threads_, [&](std::size_t row) {
    BandedDisparity banded[kMaxAround];
    std::int16_t around[kMaxAround];
    std::int16_t before[kTileArea];
    for (int column = 0; column < cloud_.columns; ++column) {
      const int tile = static_cast<int>(row) * cloud_.columns + column;
      const int candidates = planesAround(tile, 1, around);
      int count = 0;
      for (int k = 0; k < candidates; ++k) {
        const PlaneCandidate& plane = planes[static_cast<std::size_t>(around[k])];
        if (!plane.valid) continue;
        banded[count++] = {static_cast<float>(plane.normal[0]),
                           static_cast<float>(plane.normal[1]),
                           static_cast<float>(plane.offset),
                           static_cast<float>(params.tolerance(sigmas)),
                           static_cast<float>(DisparityFit::toPixels(
                               plane, fraction * params.distance_threshold, 1.0)),
                           around[k]};
      }
      if (count == 0 && !holdsPlane(tile)) continue;
      std::int16_t* labels = labelsOf(tile);
      std::memcpy(before, labels, sizeof(before));
      nearestDisparity(cloud_.x(tile), banded, count, labels);
      if (std::memcmp(before, labels, sizeof(before)) != 0) summarize(tile);
    }
  });
  constexpr int kMinPresence = 6;  // pixels of a plane for which the tiles beside are searched
  updatePresence(kMinPresence, true);
}

}  // namespace planar_mapping::detail
