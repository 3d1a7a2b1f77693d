// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/occupancy/detail/log_odds.h"
#include "planar_mapping/core/occupancy/occupancy.h"

namespace planar_mapping {

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
