// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/core/base/export.h"
#include "planar_mapping/core/occupancy/occupancy.h"
#include "planar_mapping/core/cuboids/raster/detail/plane_raster.h"

namespace planar_mapping {

/// A feature on a plane: its cell, in cells of the plane (a0, b0 of the mask included), and its
/// belief in [0, 1].
struct CellFeature {
  std::int32_t a = 0;
  std::int32_t b = 0;
  double probability = 0.0;
};

/// Probability of every occupied cell of a plane (the paper, IV): the mean over the features in it;
/// where there are none, the mean over adjacent cells that have one. [ours] Adjacent means the
/// eight around it that are occupied; values spread outwards ring by ring from the cells with
/// features, within each connected part of the mask. A part without any feature takes
/// \p dense_support, see denseSupportProbability().
/// \return one value per cell of the mask, same layout; 0 where the mask is empty
/// \throws ParameterError if a probability is NaN or out of [0, 1]; InputError if the mask's sizes
///         disagree. Features outside the mask or on empty cells do not count. O(cells + features).
PLANAR_MAPPING_EXPORT std::vector<float> cellProbabilities(const CellMask& mask,
                                                           const std::vector<CellFeature>& features,
                                                           double dense_support);

/// [ours] Probability of a plane's dense support: Eq. 4 over the plane's points, each in the group
/// of its grid cell, and the mean of that. 0 if no point is finite.
/// \param indices    the points on the plane, or null for all
/// \param resolution side of a cell, metres, > 0
/// \param sensor     position of the sensor, in the frame of the points
PLANAR_MAPPING_EXPORT double denseSupportProbability(const PointsView& points,
                                                     const Indices* indices, double resolution,
                                                     const OccupancyParams& params,
                                                     const Vector3& sensor = Vector3::Zero());

/// The same rule for points that are not features themselves, on the cubic cells of gridGroups():
/// every point takes the probability of its cell; 26 cells are adjacent, of the same label only.
/// \param features   belief per point of \p indices in its order; negative = not a feature
/// \param labels     plane of each point of the *cloud*, negative = none, or null
/// \return one value per point of \p indices: a feature its own belief; a point out of reach of
///         any feature -1 (its dense support has to judge); 0 for a non-finite one
/// \throws ParameterError, InputError
PLANAR_MAPPING_EXPORT std::vector<float> spreadToPoints(const PointsView& points,
                                                        const Indices* indices,
                                                        const std::vector<std::int32_t>* labels,
                                                        double resolution,
                                                        const std::vector<float>& features);

}  // namespace planar_mapping
