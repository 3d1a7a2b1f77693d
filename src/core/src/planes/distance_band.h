// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "planar_mapping/core/planes/multi_plane.h"

namespace planar_mapping::detail {

/// d_T(z) = max(d_T, k dz(z)), with dz = z^2 / (B f) dd written as one factor of z^2.
struct DistanceBand {
  double constant = 0.05;
  double per_square_depth = 0.0;

  explicit DistanceBand(const MultiPlaneParams& params) : constant(params.distance_threshold) {
    if (params.noise) per_square_depth = params.noise_factor * params.noise->depthError(1.0);
  }
  double at(double z) const { return std::max(constant, per_square_depth * z * z); }
};

}  // namespace planar_mapping::detail
