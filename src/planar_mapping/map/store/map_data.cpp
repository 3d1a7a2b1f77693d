// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/store/map_data.h"

#include "planar_mapping/base/lists.h"

namespace planar_mapping::detail {

std::size_t MapData::memoryBytes() const {
  std::size_t bytes = capacityBytes(planes) + capacityBytes(trajectory) +
                      capacityBytes(ground.places()) + cells.memoryBytes() + space.memoryBytes();
  for (const PlaneLayer& layer : planes) bytes += layer.raster.memoryBytes();
  return bytes;
}

const PlaneLayer& MapData::plane(std::int32_t id) const {
  return *std::lower_bound(planes.begin(), planes.end(), id,
                           [](const PlaneLayer& p, std::int32_t i) { return p.id < i; });
}

std::size_t MapData::commit() {
  std::size_t modified = cells.commit(revision());
  for (PlaneLayer& layer : planes) modified += layer.raster.commit(revision());
  // The id of a plane without a cell is not given out again.
  eraseIf(planes, [](const PlaneLayer& p) { return p.raster.patches().empty(); });
  planes.shrink_to_fit();
  return modified;
}

}  // namespace planar_mapping::detail
