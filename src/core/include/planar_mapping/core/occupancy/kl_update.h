// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/base/export.h"

namespace planar_mapping {

/// Constants of the update of a belief (the paper, III-E).
struct PLANAR_MAPPING_EXPORT KlUpdateParams {
  double eta2 = 1.0;   ///< normalisation of Eq. 7, in (0, 1]
  double eta3 = 1.0;   ///< normalisation of Eq. 10, in (0, 1]
  double bias = 1.07;  ///< A of Eq. 10, dimensionless, >= 0; larger doubts weak evidence more
  /// [ours] Beliefs are kept this far from 0 and 1 before the logarithm, in (0, 0.5).
  double clamp = 1e-6;

  /// \throws ParameterError
  void validate() const;
};

/// q = eta2 * p_{t+k} * p(x_{t+k} | x_t), the belief that the new sighting alone gives
/// (the paper, Eq. 7).
/// \param probability    p_{t+k}, the feature's probability in the new frame (Eq. 4), in [0, 1]
/// \param motion_factor  p(x_{t+k} | x_t) relative to its peak (Eq. 9), in [0, 1]
/// \throws ParameterError if an argument is NaN or out of range
PLANAR_MAPPING_EXPORT double observedBelief(double probability, double motion_factor,
                                            const KlUpdateParams& params = KlUpdateParams());

/// D = p log(p / q), natural logarithm: one term of the sum (the paper, Eq. 5, 6).
/// \param before   p, belief from the earlier frame, in [0, 1]
/// \param observed q, belief the new sighting gives, in [0, 1]
/// \note [ours] both are clamped to [clamp, 1 - clamp] first
/// \throws ParameterError if an argument is NaN or out of range
PLANAR_MAPPING_EXPORT double klDivergence(double before, double observed,
                                          const KlUpdateParams& params = KlUpdateParams());

/// Belief in a feature after it was seen again, eta3 * exp(-E) with E = |D| + A if both p <= 0.5
/// and q <= 0.5, else |D| (the paper, Eq. 10).
/// \param before   p, belief from the earlier frame, in [0, 1]
/// \param observed q, see observedBelief(), in [0, 1]
/// \return belief in [0, 1]
/// \throws ParameterError if an argument is NaN or out of range
PLANAR_MAPPING_EXPORT double updatedBelief(double before, double observed,
                                           const KlUpdateParams& params = KlUpdateParams());

}  // namespace planar_mapping
