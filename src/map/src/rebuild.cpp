// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "map_data.h"

namespace planar_mapping::detail {

void rebuildCuboids(MapData& map, FrameUpdate& update) {
  // Every plane is asked, as a merge touches planes the frame did not see; a clean one costs a
  // look at its patches.
  for (PlaneLayer& layer : map.planes) {
    update.patches_rebuilt += layer.rebuild(map.params.approximation);
  }
  // A plane without a cell is forgotten; its id is not given out again.
  map.planes.erase(std::remove_if(map.planes.begin(), map.planes.end(),
                                  [](const PlaneLayer& layer) { return layer.patches.empty(); }),
                   map.planes.end());
  update.patches_rebuilt += map.cells.rebuild(map.params.approximation, map.trajectory);
}

}  // namespace planar_mapping::detail
