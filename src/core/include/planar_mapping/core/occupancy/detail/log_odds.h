// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/base/export.h"

namespace planar_mapping {

/// Constants of the classical log-odds update (Moravec and Elfes; the values are OctoMap's). It is
/// here to be compared with the update of the paper, on the same interface.
struct PLANAR_MAPPING_EXPORT LogOddsParams {
  double prior = 0.5;               ///< probability before anything was seen, in (0, 1)
  double hit = 0.7;                 ///< p(occupied | seen), in (0.5, 1)
  double miss = 0.4;                ///< p(occupied | seen where it should not be), in (0, 0.5)
  double min_probability = 0.1192;  ///< clamping, in (0, 0.5)
  double max_probability = 0.971;   ///< clamping, in (0.5, 1)
  double hit_threshold = 0.5;  ///< [ours] a sighting of at least this belief is a hit, in [0, 1]

  /// \throws ParameterError
  void validate() const;
};

/// ln(p / (1 - p)).
/// \param probability  in (0, 1)
/// \throws ParameterError if it is NaN or out of range
PLANAR_MAPPING_EXPORT double logOdds(double probability);

/// The probability of log-odds: 1 / (1 + exp(-l)), in [0, 1].
/// \throws ParameterError if the argument is NaN
PLANAR_MAPPING_EXPORT double probabilityOfLogOdds(double log_odds);

/// Belief after one more measurement: L = L_before + L_hit or L_miss - L_prior, clamped.
/// \param before  belief so far, in [0, 1]; the prior if nothing was seen yet
/// \param is_hit  the measurement says occupied
/// \return belief in [min_probability, max_probability]
/// \throws ParameterError if before is NaN or out of range
PLANAR_MAPPING_EXPORT double logOddsUpdate(double before, bool is_hit,
                                           const LogOddsParams& params = LogOddsParams());

}  // namespace planar_mapping
