// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "planar_mapping/localization/view_matching.h"

namespace planar_mapping::detail {

struct Alignment {
  Pose T_now_map = Pose::Identity();
  Matrix6 information = Matrix6::Zero();  ///< of T_now_map, see Matrix6
};

/// Which cells, and how often.
enum class AlignLevel {
  Search,  ///< half of the cells of 8 pixels, from far away
  Track,   ///< the same, from near by
  Refine,  ///< half of the cells of 4 pixels
};

/// Point to plane and gray values, cells of the map against the cell of the frame that they are
/// seen in, from a start.
Alignment alignViews(const LocalMap& map, const View& now, const Pose& start, AlignLevel level);

/// Starts for alignViews() where nothing is known: turned and moved about what is seen.
std::vector<Pose> startsAround(const Pose& T_now_map, double depth);

}  // namespace planar_mapping::detail
