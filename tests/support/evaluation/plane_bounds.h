// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "evaluation/plane_quality.h"
#include "planar_mapping/core/base/types.h"
#include "planar_mapping/core/planes/multi_plane.h"

// How well planes can be found at best: what the noise of a cloud leaves to a search that knows
// more than any search can.

namespace planar_mapping {
namespace evaluation {

/// What a labelling by planes that are known believes of an image.
struct KnownPlanesParams {
  double range_noise = 0.02;  ///< standard deviation along the rays, white, metres, > 0
  /// Cost of two neighbouring pixels on different planes, beside the squared error along the ray
  /// over twice the variance, > 0.
  double edge_cost = 1.5;
  double most_cost = 12.0;  ///< of the error of a point, which may be on no plane at all, > 0
  int sweeps = 8;           ///< over rows and columns and back, >= 0
  int min_points = 100;     ///< planes that get fewer points are left out, >= 1

  /// \throws ParameterError
  void validate() const;
};

/// Gives every point of an image seen from the origin to one of the planes of its scene by
/// max-product belief propagation on the grid of pixels: noise along the ray, and a cost for every
/// edge. No labels go in, but the planes do, which makes it an upper bound of what a search for
/// planes can reach with the same belief. Non-finite points get none. Takes 20 bytes a point and
/// plane, and time as that.
/// \return the planes that have points, in their order; only `plane` and `inliers` are filled
/// \throws InputError if the cloud is not organized; ParameterError
std::vector<PlaneSegment> assignToKnownPlanes(const PointsView& points,
                                              const std::vector<Plane>& planes,
                                              const KnownPlanesParams& params);

/// Another measurement of the same scene: each point on a true plane at the intersection of its ray
/// with that plane plus white noise along the ray; all others as they are. Planes fitted to it are
/// as far off as planes of that noise must be, and do not know the noise of the first measurement.
/// \param range_noise standard deviation, metres, >= 0
/// \return xyz triples
/// \throws InputError if sizes disagree; ParameterError
std::vector<float> measuredAgain(const PointsView& points, const PlaneTruth& truth,
                                 double range_noise, std::uint64_t seed);

}  // namespace evaluation
}  // namespace planar_mapping
