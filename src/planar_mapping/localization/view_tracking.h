// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "planar_mapping/localization/view_matching.h"

namespace planar_mapping::detail {

/// Features of the map in a frame whose pose is nearly known, by optical flow from where they
/// should be seen.
struct TrackedFeatures {
  std::vector<FeatureMatch> matches;
  std::vector<std::size_t> views;     ///< of the map, one per match
  std::vector<std::size_t> expected;  ///< per view: features that should be seen
};
TrackedFeatures trackFeatures(const LocalMap& map, const View& now, const Pose& T_now_map);

}  // namespace planar_mapping::detail
