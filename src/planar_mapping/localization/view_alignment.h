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

/// Point to plane and gray values, cells of the map against the cell of the frame that they are
/// seen in, from a start. \param coarse  cells of 8 pixels, every second of each row, else all of 4
Alignment alignViews(const LocalMap& map, const View& now, const Pose& start, bool coarse);

/// Starts for alignViews() where nothing is known: turned and moved about what is seen.
std::vector<Pose> startsAround(const Pose& T_now_map, double depth);

}  // namespace planar_mapping::detail
