// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/atlas/atlas_data.h"
#include "planar_mapping/base/export.h"

namespace planar_mapping {

/// What solving changed.
struct PoseGraphResult {
  std::vector<std::int64_t> moved;  ///< ids of submaps whose T_world_submap changed, ascending
  double ms = 0.0;
};

/// Moves the submaps so that the links agree: poses of each component by least squares over its
/// links, robust against wrong ones.
///
/// Links that contradict the others become Rejected before: neighbours are trusted, of the others
/// those are used that agree in pairs. Two components are joined by at least two pairs of keyframes
/// that agree (of clouds without images: of submaps), or by one with very much evidence, beyond
/// what contradicts them; links that do not suffice are Rejected until more of them come. Refused
/// ones do not exist for it. Links between joined submaps get their residual, others the last one.
///
/// The first submap of a component stays where it is; one that begins a component after it had been
/// joined to another returns to the identity, the frame that its poses were found in. Apart from
/// that the poses depend on the links alone, not on earlier poses, states or residuals: refusing a
/// link gives the same bytes as if it had never been found. One thread; not thread safe where other
/// threads write to glog.
/// \throws InputError for a link whose submaps are not there or one and the same, that is not rigid
///         or whose covariance is not positive definite; nothing has changed
PLANAR_MAPPING_EXPORT PoseGraphResult solvePoseGraph(AtlasData& data);

}  // namespace planar_mapping
