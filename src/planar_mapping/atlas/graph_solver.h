// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/atlas/link_consistency.h"

namespace planar_mapping::detail {

/// motionDifference() between the motion that a link measured and T_world_to^-1 T_world_from.
/// Jacobians are with respect to steps T -> T * motionStep(step) of the two poses; may be null.
Vector6 linkError(const Pose& T_from_to, const Pose& T_world_from, const Pose& T_world_to,
                  Matrix6* by_from, Matrix6* by_to);

/// Poses of the nodes of one part by least squares over its links. Where some links do not agree
/// with the solution it is made robust against them (Geman and McClure, graduated).
/// \param members  numbers of the links of the part
/// \param poses    of all nodes; those of the part are moved, but for \p fixed
/// \return per member: it contradicts the solution
std::vector<std::uint8_t> solvePart(const std::vector<GraphLink>& links,
                                    const std::vector<std::size_t>& members,
                                    std::vector<Pose>& poses, std::size_t fixed);

}  // namespace planar_mapping::detail
