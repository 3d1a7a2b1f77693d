// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "planar_mapping/base/error.h"
#include "planar_mapping/localization/localizer.h"

namespace planar_mapping {

SensorNoise SensorNoise::ofPair(double focal_length, double baseline, double disparity_error) {
  SensorNoise noise;
  noise.inverse_depth = disparity_error / (focal_length * baseline);
  noise.relative = 0.0;
  return noise;
}

double SensorNoise::depthSigma(double rho) const {
  const double of_rho = relative * rho;
  return std::sqrt(inverse_depth * inverse_depth + of_rho * of_rho);
}

void SensorNoise::validate() const {
  requirePositive("noise.pixel", pixel, "px");
  requireInRange("noise.pixel_per_size", pixel_per_size, 0.0, 1.0);
  requirePositive("noise.inverse_depth", inverse_depth, "1/m");
  requireInRange("noise.relative", relative, 0.0, 1.0);
  requirePositive("noise.gray", gray);
}

void LocalizerParams::validate() const {
  noise.validate();
  requireInRange("min_log_odds", min_log_odds, -10.0, 10.0);
  requireInRange("keyframe_overlap", keyframe_overlap, 0.0, 1.0);
}

}  // namespace planar_mapping
