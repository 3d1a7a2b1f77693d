// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/planes/tiles/organized_growing.h"
#include "planar_mapping/planes/tiles/plane_fit.h"

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
  double growing_factor = 3.5;
  /// Fraction of max_normal_deviation between the normal of a cell and the plane it joins.
  double growing_angle_fraction = 0.55;
  /// Largest quadratic noise that is believed, 1/m: beyond it windows see clutter, not noise.
  double max_quadratic_noise = 0.004;
  /// Up to this many the noise is that of single pixels, and small windows tell it best.
  double white_correlation = 3.0;
  /// Noise below this fraction of d_T is not told apart from none.
  double smallest_noise_fraction = 0.01;
  /// ... and in single quarters of tiles, of which the borders of small planes consist, below this.
  double smallest_quarter_noise_fraction = 0.015;
  /// Fraction of d_T that is added to the noise when planes compete for a pixel.
  double competing_fraction = 0.05;
  /// A plane at least this many residuals wide is not a slice through unrelated objects, ...
  double clear_flatness = 12.0;
  /// ... and one at least this many wide is not bent by bent_angle.
  double straight_flatness = 33.0;
  /// Fraction of the points in the tiles of a doubtful plane that must be on it and have a
  /// neighbourhood that lies as the plane does.
  double min_agreement = 0.5;
  /// A quadratic surface that is bent by this root mean square angle (radians), ...
  double bent_angle = 0.075;
  /// ... explains the points so much better (variance ratio) ...
  double bent_advantage = 7.0;
  /// ... and bows by this fraction of d_T and by a sigma of the mean of a tile is no plane.
  double bow_fraction = 0.02;
  /// Sine of the angle between rays and plane below which ranges say little about the plane.
  double min_ray_sine = 0.05;
  /// Growth of the residual across the plane that a fit along the rays may cost.
  double max_residual_growth = 1.1;
  /// Points within this range difference (metres, and a fraction of the range) may be one surface.
  double same_surface_constant = 0.02;
  double same_surface_fraction = 0.03;
  /// Fraction of coherent_angle by which noise may turn normals of small surroundings.
  double clear_normal_fraction = 0.8;
  /// Radians that noise may turn a normal at most before it counts as another surface.
  double most_coherent_angle = 0.9;
  /// Fraction of agreeing pixels from which on a plane keeps all of its pixels.
  double clear_coherent_fraction = 0.85;
  /// Fraction of the remaining pixels within coherent_angle below which a plane is a slice through
  /// other surfaces.
  double min_coherent_fraction = 0.66;
  /// Sigmas by which ranges on two planes differ at most where noise blurs the edge between them.
  double edge_factor = 6.0;
  /// Times that planes and the pixels at their edges settle before small planes are looked for.
  int settling_rounds = 3;
};

/// Planar fit of a cell or of the window around it, along the ray to its mean.
struct CellFit {
  float normal[3];
  float mean[3];
  float residual;  ///< root mean square distance, metres
  float extent;    ///< root mean square extent along the shorter axis of the plane, metres
  float count;     ///< points

  /// Of the mean from the sensor.
  double squaredRange(const Vector3& sensor) const { return ray(sensor).squaredNorm(); }
  /// Distance of the sensor from the plane.
  double height(const Vector3& sensor) const {
    return std::fabs(ray(sensor).dot(Vector3(normal[0], normal[1], normal[2])));
  }

 private:
  Vector3 ray(const Vector3& sensor) const { return Vector3(mean[0], mean[1], mean[2]) - sensor; }
};

using CellFits = std::vector<CellFit, Unset<CellFit>>;

/// Least-squares planes of all cells of a grid; a zero normal where there is none.
CellFits fitCells(const CellGrid& grid, const Vector3& sensor);

/// Estimates the noise of the sensor from the residuals of tiles and of the windows around them.
RangeNoise estimateNoise(const CellGrid& tiles, const CellFits& fits, const CellFits& windows,
                         const Vector3& sensor, const OrganizedParams& params);

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
  /// Whether the noise is that of single pixels.
  bool isWhite() const { return noise_.correlated_pixels <= params_.white_correlation; }
  /// Whether noise blurs edges at this range: it is white and beyond how flat surfaces are.
  bool blursEdges(double squared_range) const {
    return isWhite() && noise_.at(squared_range) > params_.flatDistance();
  }
  void setNoise(const RangeNoise& noise) { noise_ = noise; }

  void fit(PlaneCandidate& plane) const override;
  /// Least squares of 1 / r along the rays of the sensor, weighted by the noise, of directions that
  /// are exact. Unlike the fit across the plane it is not biased by noise along oblique rays, and
  /// far points weigh less. Keeps the plane where the rays graze it.
  void refine(PlaneCandidate& plane, const std::vector<TilePart>& parts,
              const PartList& list) const override;
  bool areOne(const PlaneCandidate& one, const PlaneCandidate& other, bool adjacent,
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
  MetricGrower(const CellGrid& grid, bool wide, const MetricFit& fit);

  /// Of the sensor, from the fits of cells and windows.
  RangeNoise noise() const;

 private:
  void classify() override;
  bool accepts(const PlaneCandidate& plane, const MomentSums& sums,
               const CellState& state) const override;

  const MetricFit& fit_;
  double least_noise_;  ///< below it noise is not told apart from none, metres
  CellFits fits_;
  CellFits window_fits_;
  CellFits wide_fits_;
};

}  // namespace planar_mapping::detail
