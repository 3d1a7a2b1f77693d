// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/occupancy/detail/belief_update.h"

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {

void BeliefUpdateParams::validate() const {
  KlUpdateParams::validate();
  requireInRange("rule", static_cast<int>(rule), 0, static_cast<int>(UpdateRule::None));
  log_odds.validate();
}

double firstBelief(double probability, const BeliefUpdateParams& params) {
  requireInRange("probability", probability, 0.0, 1.0);
  if (params.rule != UpdateRule::LogOdds) return probability;
  const LogOddsParams& odds = params.log_odds;
  return logOddsUpdate(odds.prior, probability >= odds.hit_threshold, odds);
}

double nextBelief(double before, double probability, double motion_factor,
                  const BeliefUpdateParams& params) {
  const double observed = observedBelief(probability, motion_factor, params);
  switch (params.rule) {
    case UpdateRule::LogOdds:
      return logOddsUpdate(before, observed >= params.log_odds.hit_threshold, params.log_odds);
    case UpdateRule::None:
      return probability;
    case UpdateRule::KullbackLeibler:
      break;
  }
  return updatedBelief(before, observed, params);
}

}  // namespace planar_mapping
