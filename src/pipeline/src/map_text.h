// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planar_mapping/map/planar_map.h"

namespace planar_mapping::detail {

/// The planes and cuboids of a map as JSON text, one cuboid a line.
std::string mapToJson(const PlanarMap& map);

}  // namespace planar_mapping::detail
