// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "map_data.h"

namespace planar_mapping::detail {

void tidyMap(MapData& map, FrameUpdate& update) {
  const auto revision = static_cast<std::uint32_t>(map.trajectory.size() + 1);
  // Every plane is asked, as a merge touches planes the frame did not see; a clean one costs a
  // look at its patches.
  for (PlaneLayer& layer : map.planes) {
    layer.settle();
    update.patches_rebuilt += layer.tidy(revision);
  }
  // A plane without a cell is forgotten; its id is not given out again.
  map.planes.erase(std::remove_if(map.planes.begin(), map.planes.end(),
                                  [](const PlaneLayer& layer) { return layer.patches.empty(); }),
                   map.planes.end());
  update.patches_rebuilt += map.cells.tidy(revision);
}

}  // namespace planar_mapping::detail
