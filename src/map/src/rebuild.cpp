// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "map_data.h"

namespace planar_mapping::detail {

void rebuildCuboids(MapData& map, FrameUpdate& update) {
  // Every plane is asked, as a merge touches planes the frame did not see; a clean one costs a
  // look at its patches.
  for (PlaneLayer& layer : map.planes) {
    update.patches_rebuilt += layer.rebuild(map.params.approximation);
  }
  update.patches_rebuilt += map.cells.rebuild(map.params.approximation, map.sensors);
}

}  // namespace planar_mapping::detail
