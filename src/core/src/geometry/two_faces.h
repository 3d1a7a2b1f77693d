// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "planar_mapping/core/geometry/detail/plane_moments.h"

namespace planar_mapping::detail {

/// Distance between two parallel faces, the points of each given; 0 for the halves of one thick
/// surface, which are 2.7 (Gaussian) to 3.5 (uniform) of their standard deviations apart.
inline double gapOfFaces(const PlaneMoments& a, const PlaneMoments& b) {
  constexpr double kMinDeviations = 6.0;
  const PlaneMoments::Fit fit_a = a.fit(), fit_b = b.fit();
  if (!fit_a.valid || !fit_b.valid) return 0.0;
  const Vector3 apart = b.mean() - a.mean();
  const double gap =
      std::min(std::abs(fit_a.plane.normal.dot(apart)), std::abs(fit_b.plane.normal.dot(apart)));
  return gap >= kMinDeviations * std::max(fit_a.rms, fit_b.rms) ? gap : 0.0;
}

}  // namespace planar_mapping::detail
