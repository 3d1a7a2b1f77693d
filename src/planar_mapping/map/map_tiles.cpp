// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/map_tiles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/map/integration/map_join.h"
#include "planar_mapping/map/planar_map_impl.h"

namespace planar_mapping {
namespace {

using namespace detail;

/// A column of the world.
class Column {
 public:
  Column(double side, int x, int y) : side_(side), x_(x), y_(y) {}
  bool contains(const Vector3& place) const {
    return std::floor(place.x() / side_) == x_ && std::floor(place.y() / side_) == y_;
  }

 private:
  double side_;
  int x_, y_;
};

void keepPlanes(MapData& data, const Column& column) {
  const double s = data.resolution();
  for (PlaneLayer& layer : data.planes) {
    std::vector<std::array<std::int32_t, 3>> gone;  // tile, bit
    layer.raster.forEachTile([&](std::int32_t ta, std::int32_t tb, const RasterTile& tile) {
      forEachBit(tile.occupied(), [&](std::size_t bit) {
        const auto i = static_cast<std::int32_t>(bit);
        const double a = s * (8 * ta + (i & 7) + 0.5);
        const double b = s * (8 * tb + (i >> 3) + 0.5);
        if (!column.contains(layer.frame().fromPlane({a, b, 0.0}))) gone.push_back({ta, tb, i});
      });
    });
    for (const auto& [ta, tb, bit] : gone) {
      layer.raster.find(ta, tb)->remove(static_cast<std::size_t>(bit));
      layer.raster.markDirty(ta, tb);
    }
  }
}

void keepCells(MapData& data, const Column& column) {
  const double s = data.resolution();
  for (CellLayer::Region& region : data.cells.regions.values()) {
    for (std::size_t i = 0; i < region.blocks.size(); ++i) {
      const Int3 at = unpackKey(region.blocks.key(i));
      CellBlock& block = region.blocks.value(i);
      forEachBit(block.occupied(), [&](std::size_t bit) {
        const Int3 cell = CellLayer::cellOf(at, static_cast<int>(bit));
        const Vector3 middle(cell.x + 0.5, cell.y + 0.5, cell.z + 0.5);
        if (column.contains(s * middle)) return;
        block.remove(bit);
        region.dirty = true;
      });
    }
  }
}

/// Those taken in the column, and those that cells were last seen from.
void keepFrames(MapData& data, const Column& column) {
  std::vector<std::uint8_t> is_kept(data.trajectory.size(), 0);
  for (std::size_t i = 0; i < is_kept.size(); ++i)
    is_kept[i] = column.contains(data.trajectory[i].position) ? 1 : 0;
  for (const CellLayer::Region& region : data.cells.regions.values()) is_kept[region.frame] = 1;
  const bool knows = !data.planes.empty() || !data.space.empty();
  if (knows && !is_kept.empty() && std::count(is_kept.begin(), is_kept.end(), 1) == 0)
    is_kept.front() = 1;
  std::vector<std::uint32_t> number(is_kept.size(), 0);
  std::vector<FramePose> kept;
  for (std::size_t i = 0; i < is_kept.size(); ++i) {
    number[i] = static_cast<std::uint32_t>(kept.size());
    if (is_kept[i] != 0) kept.push_back(data.trajectory[i]);
  }
  for (CellLayer::Region& region : data.cells.regions.values()) region.frame = number[region.frame];
  data.trajectory = std::move(kept);
}

double cubeOf(const MapData& data) {
  return 32.0 * data.unknownResolution();
}

}  // namespace

Eigen::AlignedBox3d reachOf(const PlanarMap& map) {
  const MapData& data = MapAccess::of(map).data;
  Eigen::AlignedBox3d reach = boundsOf(data);
  data.space.forEachRegion([&](const Int3& at, const SpaceRegion&) {
    const Vector3 low = cubeOf(data) * Vector3(at.x, at.y, at.z);
    reach.extend(low).extend(low + Vector3::Constant(cubeOf(data)));
  });
  return reach;
}

double tileSide(const PlanarMapParams& params, double side) {
  requirePositive("side", side, "m");
  const double cube = cubeOf(MapData(params));
  return cube * std::max(1.0, std::ceil(side / cube - 1e-9));
}

PlanarMap tileOf(const PlanarMap& map, double side, int x, int y) {
  if (map.isFinished()) throw InputError("a finished map cannot be cut into tiles");
  PlanarMap tile = map;
  MapData& data = MapAccess::of(tile).data;
  const Column column(side, x, y);
  keepPlanes(data, column);
  keepCells(data, column);
  UnknownSpace space(data.params.unseen);
  data.space.forEachRegion([&](const Int3& at, const SpaceRegion& region) {
    if (column.contains(cubeOf(data) * Vector3(at.x + 0.5, at.y + 0.5, at.z + 0.5)))
      space.setRegion(at, region);
  });
  data.space = std::move(space);
  data.commit();
  keepFrames(data, column);
  MapAccess::of(tile).changed();
  return tile;
}

}  // namespace planar_mapping
