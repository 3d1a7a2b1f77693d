// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "store/map_data.h"

namespace planar_mapping::detail {

/// Adds what another map knows; see PlanarMap::merge(). \throws InputError, before anything changes
FrameUpdate mergeMaps(MapData& map, const MapData& other, const Pose& T_map_other);

}  // namespace planar_mapping::detail
