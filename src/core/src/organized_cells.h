// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "organized_tiles.h"
#include "planar_mapping/core/multi_plane.h"

namespace planar_mapping::detail {

/// Standard deviation of the measured range, sigma(r) = constant + quadratic r^2, metres.
struct RangeNoise {
  double constant = 0.0;
  double quadratic = 0.0;  ///< 1/m
  double at(double squared_range) const { return constant + quadratic * squared_range; }
};

/// Parameters of the organized search beyond MultiPlaneParams; all [ours].
struct OrganizedParams {
  double distance_threshold = 0.05;   ///< d_T, metres
  double max_normal_deviation = 0.5;  ///< radians
  double noise_factor = 3.0;          ///< k of d_T(z) = max(d_T, k sigma(z))
  int min_inliers = 100;
  /// Share of d_T by which the mean of a cell may lie off the plane it joins: real surfaces are
  /// flat to a part of d_T only.
  double growing_share = 0.4;
  /// Sigmas by which the mean of a cell may lie off the plane it joins.
  double growing_factor = 2.5;
  /// Sigmas of residual up to which the neighbourhood of a cell counts as planar.
  double planar_factor = 1.6;
  /// Quantile of the residuals of small windows that is taken for the noise of the sensor.
  double noise_quantile = 0.35;
  /// Largest quadratic noise that is believed, 1/m: beyond it windows see clutter, not noise.
  double max_quadratic_noise = 0.004;
  /// Share of d_T up to which constant noise is believed.
  double max_constant_noise = 0.5;
  /// Noise is correlated between neighbouring pixels: this many count as one measurement.
  double correlated_pixels = 6.0;
  /// Noise below this share of d_T is not told apart from none.
  double smallest_noise_share = 0.01;
  /// Share of a cell that must hold points for it to join a plane as a whole.
  double min_cell_share = 0.3;
  /// Share of min_inliers that the whole cells of a plane must hold; the rest may come from
  /// border pixels.
  double min_seed_share = 0.4;
  /// Share of the growing tolerance within which two planes are one.
  double merging_factor = 0.5;
  /// Rings of tiles around grown cells whose pixels are looked at.
  int assignment_rounds = 2;
  /// Look for small and oblique planes on cells of half the size.
  bool fine_pass = true;
  /// Cells of the smallest region.
  int min_cells = 3;
};

constexpr std::size_t kMaxCandidates = 4096;  ///< planes a frame may hold before merging

/// Planar fit of a cell or of the window around it.
struct CellFit {
  float normal[3];
  float mean[3];
  float residual;  ///< root mean square distance, metres
  float extent;    ///< root mean square extent along the shorter axis of the plane, metres
};

/// A grid of cells, each the sums of its points, about the origin of the tiled cloud.
struct CellGrid {
  int columns = 0;
  int rows = 0;
  int capacity = 0;          ///< points of a full cell
  std::vector<double> sums;  ///< moment * cells + cell

  int cells() const { return columns * rows; }
  const double* moment(int m) const { return sums.data() + static_cast<std::size_t>(m) * cells(); }
  double* moment(int m) { return sums.data() + static_cast<std::size_t>(m) * cells(); }
  double count(int cell) const { return sums[static_cast<std::size_t>(cell)]; }
};

CellGrid tileGrid(const TiledCloud& cloud, int threads);
CellGrid freeQuarterGrid(const TiledCloud& cloud, const std::vector<std::int16_t>& labels,
                         int threads);

/// Sums over the (2 radius + 1)^2 cells around each cell.
CellGrid windowSums(const CellGrid& grid, int radius);

/// Least-squares planes of all cells of a grid; a zero normal where there is none.
std::vector<CellFit> fitCells(const CellGrid& grid);

/// Estimates the noise of the sensor from the residuals of small windows.
RangeNoise estimateNoise(const CellGrid& windows, const std::vector<CellFit>& fits,
                         const Vector3& sensor, const OrganizedParams& params);

}  // namespace planar_mapping::detail
