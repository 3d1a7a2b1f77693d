// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/occupancy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {

void KlUpdateParams::validate() const {
  requirePositive("eta2", eta2);
  requireInRange("eta2", eta2, 0.0, 1.0);
  requirePositive("eta3", eta3);
  requireInRange("eta3", eta3, 0.0, 1.0);
  requireInRange("bias", bias, 0.0, std::numeric_limits<double>::max());
  requirePositive("clamp", clamp);
  if (!(clamp < 0.5)) throw ParameterError("clamp", clamp, "(0, 0.5)");
}

double observedBelief(double probability, double motion_factor, const KlUpdateParams& params) {
  requireInRange("probability", probability, 0.0, 1.0);
  requireInRange("motion_factor", motion_factor, 0.0, 1.0);
  return params.eta2 * probability * motion_factor;
}

double klDivergence(double before, double observed, const KlUpdateParams& params) {
  requireInRange("before", before, 0.0, 1.0);
  requireInRange("observed", observed, 0.0, 1.0);
  const double p = std::clamp(before, params.clamp, 1.0 - params.clamp);
  const double q = std::clamp(observed, params.clamp, 1.0 - params.clamp);
  return p * std::log(p / q);
}

double updatedBelief(double before, double observed, const KlUpdateParams& params) {
  const double divergence = std::abs(klDivergence(before, observed, params));
  const bool both_weak = before <= 0.5 && observed <= 0.5;
  return params.eta3 * std::exp(-(divergence + (both_weak ? params.bias : 0.0)));
}

}  // namespace planar_mapping
