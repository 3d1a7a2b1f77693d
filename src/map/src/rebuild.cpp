// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <utility>

#include "store/map_data.h"

namespace planar_mapping::detail {

void wakePlanes(MapData& map) {
  map.planes.wake(map.resting.open());
  for (PlaneLayer& layer : map.planes) layer.wake();
}

void tidyMap(MapData& map, FrameUpdate& update) {
  if (map.planes.areAwake()) {
    // A plane without a cell is forgotten; its id is not given out again.
    update.patches_rebuilt += map.resting.close(map.planes.take(), map.revision());
  }
  update.patches_rebuilt += map.cells.tidy(map.revision());
  map.trajectory.rest();
}

}  // namespace planar_mapping::detail
