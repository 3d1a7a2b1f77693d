// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::detail {

/// A plane that would be the floor if the map were level.
struct LeaningFloor {
  double area = 0.0;  ///< of its cuboids, m2
  double tilt = 0.0;  ///< radians
};

/// The largest plane of a map that its sensors stood above and that leans by 5 to 45 degrees, if it
/// has a fifth of the area of all planes, and no level plane has half of its own: more likely than
/// such a floor is a start that was not level.
PLANAR_MAPPING_EXPORT std::optional<LeaningFloor> leaningFloor(const PlanarMap& map);

}  // namespace planar_mapping::detail
