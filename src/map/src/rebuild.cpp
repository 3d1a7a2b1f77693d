// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <utility>

#include "map_data.h"

namespace planar_mapping::detail {

void wakePlanes(MapData& map) {
  static_cast<std::vector<PlaneLayer>&>(map.planes) = map.resting.open();
  for (PlaneLayer& layer : map.planes) layer.wake();
  map.planes.awake = true;
}

void tidyMap(MapData& map, FrameUpdate& update) {
  if (map.planes.awake) {
    // A plane without a cell is forgotten; its id is not given out again.
    update.patches_rebuilt += map.resting.close(std::move(map.planes), map.revision());
    map.planes = MapData::WorkingPlanes();
  }
  update.patches_rebuilt += map.cells.tidy(map.revision());
  map.trajectory.rest();
}

}  // namespace planar_mapping::detail
