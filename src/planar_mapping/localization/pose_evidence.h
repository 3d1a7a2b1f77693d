// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/base/random.h"
#include "planar_mapping/localization/view_matching.h"

namespace planar_mapping::detail {

/// Inliers that are not on the plane which holds most of them.
std::size_t offPlane(const std::vector<FeatureMatch>& matches,
                     const std::vector<std::uint8_t>& is_inlier, Random& random);

/// Depths and gray values of the cells that the map and the frame both see, both ways, the worse
/// counts: the part of PoseEvidence that does not depend on how the pose was found.
void weighCells(const LocalMap& map, const View& now, const Pose& T_now_map,
                PoseEvidence& evidence);

/// How much likelier a pose is right than wrong (natural logarithm) by features and by what lies
/// where the other view saw through. The weights were fitted to links with known motion.
double featureLogOdds(std::size_t off_plane, double seen_again, double seen_through);

/// The same with gray values, without what was expected beforehand. \param by_features  else by
/// surfaces alone
double logOdds(const PoseEvidence& evidence, bool by_features);

}  // namespace planar_mapping::detail
