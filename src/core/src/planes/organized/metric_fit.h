// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/organized/organized_growing.h"
#include "planes/organized/plane_fit.h"

namespace planar_mapping::detail {

/// Standard deviation of the measured range, sigma(r) = constant + quadratic r^2, metres.
struct RangeNoise {
  double constant = 0.0;
  double quadratic = 0.0;  ///< 1/m
  /// Noise is correlated between neighbouring pixels: this many count as one measurement.
  double correlated_pixels = 6.0;
  double at(double squared_range) const { return constant + quadratic * squared_range; }
};

/// Parameters of the search in metres.
struct OrganizedParams : SearchParams {
  using SearchParams::SearchParams;

  /// Sigmas by which the mean of a cell may lie off the plane it joins.
  double growing_sigmas = 3.5;
  /// Largest quadratic noise that is believed, 1/m: beyond it windows see clutter, not noise.
  double max_quadratic_noise = 0.004;
  /// Up to this many correlated pixels the noise is that of single ones: small windows measure it
  /// best, and it blurs edges.
  double max_white_correlation = 3.0;
  /// Noise below this fraction of d_T is not told apart from none ...
  double min_noise_fraction = 0.01;
  /// ... and in single quarters of tiles, of which the borders of small planes consist, below this.
  double min_quarter_noise_fraction = 0.015;
  /// Fraction of d_T that is added to the noise when planes compete for a pixel.
  double competing_fraction = 0.05;
  /// A plane at least this many residuals wide is not a slice through unrelated objects ...
  double min_flatness = 12.0;
  /// ... and one at least this many wide is not bent by bent_angle.
  double min_straightness = 33.0;
  /// Fraction of the points in the tiles of other planes that must be on it and have a
  /// neighbourhood that lies as the plane does.
  double min_agreement = 0.5;
  /// Growth of the residual across the plane that a fit along the rays may cost.
  double max_residual_growth = 1.1;
  /// Fraction of the range by which points of one surface may differ in range, besides what grows.
  double same_surface_fraction = 0.03;
  /// Fraction of coherent_angle by which noise may turn normals of 3 x 3 quarters; else those of
  /// 7 x 7 are looked at.
  double clear_normal_fraction = 0.8;
  /// Fraction of agreeing pixels from which on a plane keeps all of its pixels.
  double clear_coherent_fraction = 0.85;
  /// Fraction of the remaining pixels within coherent_angle below which a plane is a slice through
  /// other surfaces.
  double min_coherent_fraction = 0.66;
  /// Sigmas by which ranges on two planes differ at most where noise blurs the edge between them.
  double edge_sigmas = 6.0;
  /// Rounds in which planes and the pixels at their edges settle before small planes are looked
  /// for.
  int settling_rounds = 3;
  /// Two sides of a fold are at this angle at least, radians, ...
  double fold_angle = 0.1;
  /// ... and explain so much more than one plane (difference of chi-square).
  double fold_gain = 40.0;
};

/// Planar fit of a cell or of the window around it, along the ray to its mean.
struct CellFit {
  float normal[3];
  float mean[3];
  float residual;  ///< root mean square distance, metres
  float extent;    ///< root mean square extent along the shorter axis of the plane, metres
  float count;     ///< points
};

/// Least-squares planes of all cells of a grid; a zero normal where there is none.
std::vector<CellFit> fitCells(const CellGrid& grid, const Vector3& sensor);

/// Least-squares plane of one set of sums.
CellFit fitSums(const MomentSums& sums, const Vector3& sensor);

/// Estimates the noise of the sensor from the residuals of tiles and of the windows around them.
RangeNoise estimateNoise(const CellGrid& tiles, const std::vector<CellFit>& fits,
                         const std::vector<CellFit>& windows, const Vector3& sensor,
                         const OrganizedParams& params);

/// Angle by which noise may turn the normal of a window, radians.
double normalError(const CellFit& fit, const RangeNoise& noise, const Vector3& sensor,
                   const OrganizedParams& params);

/// Planes in metres, relative to the origin of the tiled cloud.
class MetricFit : public PlaneFit {
 public:
  MetricFit(const OrganizedParams& params, const Vector3& sensor)
      : params_(params), sensor_(sensor) {}

  const OrganizedParams& params() const { return params_; }
  const Vector3& sensor() const { return sensor_; }
  const RangeNoise& noise() const { return noise_; }
  void setNoise(const RangeNoise& noise) { noise_ = noise; }

  void fit(PlaneCandidate& plane) const override;
  /// Least squares of 1 / r along the rays of the sensor, weighted by the noise, of directions that
  /// are exact. Unlike the fit across the plane it is not biased by noise along oblique rays, and
  /// far points weigh less. Keeps the plane where the rays graze it.
  void refine(PlaneCandidate& plane, const std::vector<TilePart>& parts,
              const PartList& list) const override;
  double joiningCost(const PlaneCandidate& one, const PlaneCandidate& other, bool adjacent,
                     PlaneCandidate& joined) const override;
  /// Only planes whose residual is not small compared with their width are tested.
  CoherenceTest coherenceTest(const PlaneCandidate& plane, const std::vector<TilePart>& parts,
                              const PartList& list) const override;
  std::vector<char> agree(const PlaneCandidate& plane, const CellGrid& windows) const override;
  bool isBent(const PlaneCandidate& plane, const Bend& bend) const override;

 private:
  OrganizedParams params_;
  Vector3 sensor_;
  RangeNoise noise_;
};

class MetricGrower : public CellGrower {
 public:
  /// \param wide cells are tiles, not quarters: also look at 5 x 5 windows, which make better seeds
  /// \param room for the sums of windows while they are fitted
  MetricGrower(const CellGrid& grid, bool wide, double* room, const MetricFit& fit);

  /// Of the sensor, from the fits of cells and windows.
  RangeNoise noise() const;

 private:
  void classify() override;
  bool accepts(const PlaneCandidate& plane, const MomentSums& sums,
               const CellState& state) const override;

  const MetricFit& fit_;
  double least_noise_;  ///< below it noise is not told apart from none, metres
  std::vector<CellFit> fits_;
  std::vector<CellFit> window_fits_;
  std::vector<CellFit> wide_fits_;
};

}  // namespace planar_mapping::detail
