// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/file/map_record.h"

#include <utility>

#include "planar_mapping/base/error.h"
#include "planar_mapping/map/file/parameter_text.h"

namespace planar_mapping::detail {
namespace {

void recordPlane(const PlaneLayer& layer, MapRecord& record) {
  PlaneRecord plane;
  plane.id = layer.id;
  plane.frames = layer.frames;
  plane.frame = layer.frame();
  plane.moments = layer.moments();
  plane.anchor = {layer.raster.anchorA(), layer.raster.anchorB()};
  std::vector<CellLabels> tiles;
  layer.raster.forEachTile([&](std::int32_t a, std::int32_t b, const RasterTile& tile) {
    tiles.push_back({{a, b, 0}, tile.occupied(), 0});
  });
  const std::size_t before = record.tiles.regions();
  record.tiles.add(tiles, kFree);
  plane.regions = static_cast<std::uint32_t>(record.tiles.regions() - before);
  for (const CellLabels& cells : tiles) {
    const RasterTile& tile = *layer.raster.find(cells.at.x, cells.at.y);
    forEachBit(cells.low, [&](std::size_t bit) { record.beliefs.push_back(tile.belief(bit)); });
  }
  record.planes.push_back(plane);
}

/// \param next  first belief of the plane's cells; that of the next plane afterwards
PlaneLayer layerOf(const PlaneRecord& plane, LabelTree::Walk& tiles, const std::uint8_t*& next) {
  PlaneLayer layer;
  layer.id = plane.id;
  layer.frames = plane.frames;
  layer.setFrame(plane.frame);
  layer.setMoments(plane.moments);
  TileRaster& raster = layer.raster;
  raster.setAnchor(plane.anchor[0], plane.anchor[1]);
  for (std::uint32_t r = 0; r < plane.regions; ++r) {
    tiles.next([&](const CellLabels& cells) {
      if (cells.low == 0) return;
      RasterTile& tile = raster.tileAt(cells.at.x, cells.at.y);
      forEachBit(cells.low, [&](std::size_t bit) { tile.setBelief(bit, *next++); });
      raster.markDirty(cells.at.x, cells.at.y);
    });
  }
  return layer;
}

void recordCells(const CellLayer& cells, MapRecord& record) {
  record.anchor = {cells.anchor.x / 4, cells.anchor.y / 4, cells.anchor.z / 4};
  std::vector<CellLabels> bundles;
  cells.forEachBlock([&](const Int3& at, const CellBlock& block) {
    bundles.push_back({at, block.occupied(), 0});
  });
  record.blocks.add(bundles, kFree);
  for (const CellLabels& b : bundles) {
    const CellBlock& block = *cells.find(b.at);
    forEachBit(b.low, [&](std::size_t bit) {
      record.beliefs.push_back(block.belief(bit));
      if (record.params.approximation.profile == Profile::Paper) {
        record.means.push_back(block.mean(bit));
      } else {
        record.octants.push_back(block.octants(bit));
      }
    });
  }
  for (const std::uint64_t key : cells.regions.sortedKeys()) {
    record.region_frames.push_back(cells.regions.find(key)->frame);
  }
}

/// \param belief of the first cell
void restoreCells(const MapRecord& record, const std::uint8_t* belief, MapData& map) {
  CellLayer& cells = map.cells;
  cells.anchor = {4 * record.anchor.x, 4 * record.anchor.y, 4 * record.anchor.z};
  LabelTree::Walk walk(record.blocks);
  std::size_t next = 0;
  for (std::size_t r = 0; r < record.blocks.regions(); ++r) {
    walk.next([&](const CellLabels& b) {
      if (b.low == 0) return;
      CellBlock& block = cells.blockAt(b.at);
      forEachBit(b.low, [&](std::size_t bit) {
        block.setBelief(bit, belief[next]);
        if (map.isCompact()) {
          block.setOctants(bit, record.octants[next]);
        } else {
          block.setMean(bit, record.means[next]);
        }
        ++next;
      });
      cells.markDirty(b.at, 0);
    });
  }
  const std::vector<std::uint64_t> regions = cells.regions.sortedKeys();
  if (regions.size() != record.region_frames.size()) {
    throw Error("the map names another number of regions than it has");
  }
  for (std::size_t r = 0; r < regions.size(); ++r) {
    if (record.region_frames[r] >= map.trajectory.size()) {
      throw Error("the map names a frame that is not in its trajectory");
    }
    cells.regions.find(regions[r])->frame = record.region_frames[r];
  }
}

/// What is not stored is unknown, or kOccupied where space is free unless something says otherwise;
/// in a finished map that is free: no query tells never seen from seen free.
LabelTree treeOf(const UnknownSpace& space, bool is_finished) {
  const bool is_unknown = space.isUnseenUnknown();
  const bool tells_never = !is_unknown && !is_finished;
  const Label background = is_unknown ? kUnknown : is_finished ? kFree : kOccupied;
  LabelTree tree(3);
  std::vector<CellLabels> bundles;  // of one region: a large map has millions of blocks
  space.forEachBlock([&](const Int3& at, const UnknownSpace::Block& block) {
    if (is_unknown ? block.free == 0 : is_finished && block.unknown == 0) return;
    if (!bundles.empty() && !(tree.regionOf(at) == tree.regionOf(bundles[0].at))) {
      tree.add(bundles, background);
      bundles.clear();
    }
    bundles.push_back({at, tells_never ? ~(block.free | block.unknown) : 0,
                       is_unknown ? ~block.free : block.unknown});
  });
  tree.add(bundles, background);
  return tree;
}

void restoreSpace(const MapRecord& record, UnknownSpace& space) {
  const bool is_unknown = space.isUnseenUnknown();
  LabelTree::Walk walk(record.space);
  std::vector<UnknownSpace::PlacedBlock> blocks;
  for (std::size_t r = 0; r < record.space.regions(); ++r) {
    blocks.clear();
    walk.next([&](const CellLabels& b) {
      const std::uint64_t free = record.is_finished && !is_unknown ? 0 : ~(b.low | b.high);
      const std::uint64_t unknown = is_unknown ? 0 : b.high & ~b.low;
      if ((free | unknown) != 0) blocks.push_back({b.at, {free, unknown}});
    });
    space.add(blocks);
  }
}

}  // namespace

MapRecord finishedRecordOf(const MapData& map, std::vector<Cuboid> cuboids) {
  MapRecord record;
  record.is_finished = true;
  record.params = parametersOf(parameterText(map.params, true));
  record.cuboids = std::move(cuboids);
  for (Cuboid& cuboid : record.cuboids) cuboid.probability = 1.0f;
  record.space = treeOf(map.space, true);
  return record;
}

MapRecord recordOf(const MapData& map, std::vector<Cuboid> cuboids) {
  MapRecord record;
  record.params = map.params;
  record.cuboids = std::move(cuboids);
  record.next_plane_id = map.next_plane_id;
  for (const PlaneLayer& layer : map.planes) recordPlane(layer, record);
  recordCells(map.cells, record);
  record.space = treeOf(map.space, false);
  record.trajectory = map.trajectory;
  record.ground = map.ground.places();
  return record;
}

MapData mapOf(const MapRecord& record) {
  MapData map(record.params);
  map.trajectory = record.trajectory;
  map.ground.restore(record.ground);
  map.next_plane_id = record.next_plane_id;
  LabelTree::Walk tiles(record.tiles);
  const std::uint8_t* next = record.beliefs.data();
  for (const PlaneRecord& plane : record.planes) map.planes.push_back(layerOf(plane, tiles, next));
  restoreCells(record, next, map);
  restoreSpace(record, map.space);
  map.commit();
  return map;
}

}  // namespace planar_mapping::detail
