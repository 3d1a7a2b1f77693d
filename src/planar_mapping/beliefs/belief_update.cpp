// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/beliefs/belief_update.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

void requireBetween(const char* name, double value, double low, double high, const char* range) {
  if (!(value > low && value < high)) throw ParameterError(name, value, range);
}

}  // namespace

void LogOddsParams::validate() const {
  requireBetween("prior", prior, 0.0, 1.0, "(0, 1)");
  requireBetween("hit", hit, 0.5, 1.0, "(0.5, 1)");
  requireBetween("miss", miss, 0.0, 0.5, "(0, 0.5)");
  requireBetween("min_probability", min_probability, 0.0, 0.5, "(0, 0.5)");
  requireBetween("max_probability", max_probability, 0.5, 1.0, "(0.5, 1)");
  requireInRange("hit_threshold", hit_threshold, 0.0, 1.0);
}

double logOdds(double probability) {
  requireBetween("probability", probability, 0.0, 1.0, "(0, 1)");
  return std::log(probability / (1.0 - probability));
}

double probabilityOfLogOdds(double log_odds) {
  if (std::isnan(log_odds)) throw ParameterError("log_odds", log_odds, "any number");
  return 1.0 / (1.0 + std::exp(-log_odds));
}

double logOddsUpdate(double before, bool is_hit, const LogOddsParams& params) {
  requireInRange("before", before, 0.0, 1.0);
  const double clamped = std::clamp(before, params.min_probability, params.max_probability);
  const double sum =
      logOdds(clamped) + logOdds(is_hit ? params.hit : params.miss) - logOdds(params.prior);
  return std::clamp(probabilityOfLogOdds(sum), params.min_probability, params.max_probability);
}

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
