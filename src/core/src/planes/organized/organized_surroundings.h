// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planes/organized/metric_fit.h"

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
    return static_cast<float>(params_.same_surface_constant) +
           static_cast<float>(params_.same_surface_share) * range;
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

}  // namespace planar_mapping::detail
