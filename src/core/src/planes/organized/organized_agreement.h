// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/organized/organized_assignment.h"

namespace planar_mapping::detail {

/// Tells how the measured points around the quarters of tiles lie, of a plane or not. Quarters form
/// a grid of 2 columns x 2 rows per tile.
class Surroundings {
 public:
  Surroundings(const TiledCloud& cloud, const OrganizedParams& params, int threads);

  int columns() const { return columns_; }
  int rows() const { return rows_; }

  /// Planes of what lies around the quarters, up to \p radius quarters away, at about their range.
  /// \param list quarters, ascending
  /// \param room for the sums of as many windows
  std::vector<CellFit> fits(const std::vector<std::int32_t>& list, int radius, double* room) const;

 private:
  /// Range difference of one surface; a quarter as spread as this lies across a depth edge.
  float gateAt(float range) const {
    return static_cast<float>(params_.growingDistance()) +
           static_cast<float>(params_.same_surface_fraction) * range;
  }

  int columns_;
  int rows_;
  Vector3 sensor_;  ///< relative to the origin of the tiled cloud, metres
  const OrganizedParams& params_;
  int threads_;
  std::vector<MomentSums> sums_;  ///< of all measured points of each quarter
  std::vector<float> range_;      ///< of their mean from the sensor, metres; negative if none
  std::vector<float> spread_;     ///< root mean square distance from the mean, metres
};

/// Frees the pixels whose surroundings do not lie as their plane does: what a plane cuts out of
/// objects it passes through, and what of a bent surface has turned away from it. Surroundings are
/// all measured points near a quarter of a tile, of the plane or not, so that a thin slice cannot
/// vouch for itself. They are wider where the noise is too large for a small window. A plane nearly
/// all of whose pixels agree keeps them all, one that few agree with loses them all.
void freeDisagreeing(const TiledCloud& cloud, const std::vector<PlaneCandidate>& planes,
                     const MetricFit& fit, int threads, PixelAssigner& pixels);

}  // namespace planar_mapping::detail
