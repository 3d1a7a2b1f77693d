// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "planar_mapping/base/export.h"
#include "planar_mapping/beliefs/occupancy.h"

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

/// How a belief follows what is seen.
enum class UpdateRule : std::uint8_t {
  KullbackLeibler,  ///< the paper, Eq. 5 to 10
  LogOdds,          ///< the classical one, as comparison
  None,             ///< the newest sighting counts alone: what there is without an update
};

/// Constants of the update: those of the paper and what else may be chosen.
struct PLANAR_MAPPING_EXPORT BeliefUpdateParams : KlUpdateParams {
  UpdateRule rule = UpdateRule::KullbackLeibler;
  LogOddsParams log_odds;  ///< of UpdateRule::LogOdds

  /// \throws ParameterError
  void validate() const;
};

/// Belief in what is seen for the first time: Eq. 4 as it is, or the prior after a first hit or
/// miss of the log-odds.
/// \param probability  Eq. 4, in [0, 1]
/// \return belief in [0, 1]
/// \throws ParameterError if an argument is NaN or out of range
PLANAR_MAPPING_EXPORT double firstBelief(double probability,
                                         const BeliefUpdateParams& params = BeliefUpdateParams());

/// Belief in what is seen again.
/// \param before         belief so far, in [0, 1]
/// \param probability    Eq. 4 in this frame, in [0, 1]
/// \param motion_factor  Eq. 9 relative to its peak, in [0, 1]
/// \return belief in [0, 1]
/// \throws ParameterError if an argument is NaN or out of range
PLANAR_MAPPING_EXPORT double nextBelief(double before, double probability, double motion_factor,
                                        const BeliefUpdateParams& params = BeliefUpdateParams());

}  // namespace planar_mapping
