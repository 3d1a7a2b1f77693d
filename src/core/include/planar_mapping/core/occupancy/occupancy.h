// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/base/types.h"
#include "planar_mapping/core/geometry/stereo_noise.h"

namespace planar_mapping {

/// Parameters of the occupancy probability of a feature (the paper, III-D).
struct PLANAR_MAPPING_EXPORT OccupancyParams {
  StereoNoise noise;  ///< B, f and the disparity error dd = 0.5 px
  double eta1 = 1.0;  ///< eta1 of Eq. 4, the belief at the peak, in (0, 1]
  /// [ours] Belief in a group of one, which has no mean range of others, in [0, 1].
  double single_feature_probability = 0.5;
  /// [ours] Lower bound of dr, metres, >= 0; 0 = the paper. A cell of side s holds ranges up to
  /// s * sqrt(3) apart however small the noise, and near the camera Eq. 4 would doubt all of them.
  double min_range_error = 0.0;
  /// [ours] Direction in which depth z is measured, from the sensor; zero = depth is the range
  /// (laser scanners). Need not have unit length.
  Vector3 optical_axis = Vector3::UnitZ();

  /// \throws ParameterError
  void validate() const;
};

/// Depth z of a point relative to the sensor, metres, >= 0 (see OccupancyParams::optical_axis).
PLANAR_MAPPING_EXPORT double depthOf(const Vector3& point, const Vector3& optical_axis);

/// Range error dr = (rbar / z) * dz, metres (the paper, III-D).
/// \param mean_range  rbar, mean range of the group, metres, >= 0
/// \param depth       z of the feature, metres, >= 0
/// \throws ParameterError if an argument is NaN, infinite or negative
PLANAR_MAPPING_EXPORT double rangeError(double mean_range, double depth, const StereoNoise& noise);

/// Occupancy probability of a feature, eta1 * exp(-1/2 ((r - rbar) / dr)^2) (the paper, Eq. 4).
/// \param range        r, Euclidean range of the feature, metres
/// \param mean_range   rbar, metres
/// \param range_error  dr, metres, >= 0; where it is 0, only r = rbar has a belief above 0
/// \return in [0, eta1]
/// \throws ParameterError if an argument is NaN or out of range
PLANAR_MAPPING_EXPORT double featureProbability(double range, double mean_range, double range_error,
                                                double eta1 = 1.0);

/// Eq. 4 for many features at once; O(n log n).
/// \param points  the features, relative to the sensor, metres
/// \param indices the features that count, or null for all
/// \param groups  group of each feature of \p indices, in its order (the features in one grid cell
///                of one plane); any values, negative = a group of its own
/// \return one belief per feature of \p indices, in its order; 0 for a non-finite one, which does
///         not count in its group either
/// \throws ParameterError; InputError for an index outside the cloud or sizes that disagree
PLANAR_MAPPING_EXPORT std::vector<float> featureProbabilities(
    const PointsView& points, const Indices* indices, const std::vector<std::int32_t>& groups,
    const OccupancyParams& params);

}  // namespace planar_mapping
