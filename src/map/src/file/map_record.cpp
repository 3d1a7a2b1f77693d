// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "file/map_record.h"

#include <algorithm>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::detail {
namespace {

/// Calls visit(bundle, bit) for every cell, in the order of the file.
template <typename Visit>
void forEachCell(const std::vector<LatticeBundle>& bundles, Visit&& visit) {
  for (const LatticeBundle& b : bundles) {
    for (std::uint64_t bits = b.ones; bits != 0; bits &= bits - 1) {
      visit(b, static_cast<std::size_t>(__builtin_ctzll(bits)));
    }
  }
}

PlaneRecord recordOf(const PlaneLayer& layer) {
  PlaneRecord record;
  record.id = layer.id;
  record.frames = layer.frames;
  record.stored = layer.stored();
  record.anchor = {layer.raster.anchorA(), layer.raster.anchorB()};
  layer.raster.forEachTile([&](std::int32_t a, std::int32_t b, const RasterTile& tile) {
    record.tiles.push_back({{a, b, 0}, tile.occupied(), 0});
  });
  LatticeCoder::sort(2, record.tiles);
  forEachCell(record.tiles, [&](const LatticeBundle& b, std::size_t bit) {
    record.beliefs.push_back(layer.raster.find(b.at.x, b.at.y)->belief(bit));
  });
  return record;
}

PlaneLayer layerOf(const PlaneRecord& record) {
  PlaneLayer layer;
  layer.id = record.id;
  layer.restore(record.stored);
  layer.frames = record.frames;
  TileRaster& raster = layer.raster;
  raster.setAnchor(record.anchor[0], record.anchor[1]);
  std::size_t next = 0;
  for (const LatticeBundle& b : record.tiles) {
    RasterTile& tile = raster.tileAt(b.at.x, b.at.y);
    for (std::uint64_t bits = b.ones; bits != 0; bits &= bits - 1) {
      tile.setBelief(static_cast<std::size_t>(__builtin_ctzll(bits)), record.beliefs[next++]);
    }
    raster.markDirty(b.at.x, b.at.y);
  }
  return layer;
}

void recordCells(const CellLayer& cells, MapRecord& record) {
  record.anchor = {cells.anchor.x / 4, cells.anchor.y / 4, cells.anchor.z / 4};
  KeyMap<CellBlock> blocks;
  cells.forEachBlock([&](const Int3& at, const CellBlock& block) {
    record.blocks.push_back({at, block.occupied(), 0});
    blocks[packKey(at)] = block;
  });
  LatticeCoder::sort(3, record.blocks);
  forEachCell(record.blocks, [&](const LatticeBundle& b, std::size_t bit) {
    const CellBlock& block = *blocks.find(packKey(b.at));
    record.beliefs.push_back(block.belief(bit));
    if (block.hasMeans()) {
      record.means.push_back(block.mean(bit));
    } else {
      record.octants.push_back(block.octants(bit));
    }
  });
  std::vector<std::uint64_t> regions = cells.regions.keys();
  std::sort(regions.begin(), regions.end());
  for (const std::uint64_t key : regions) {
    record.region_frames.push_back(cells.regions.find(key)->frame);
  }
}

void restoreCells(const MapRecord& record, MapData& map) {
  CellLayer& cells = map.cells;
  cells.anchor = {4 * record.anchor.x, 4 * record.anchor.y, 4 * record.anchor.z};
  for (const LatticeBundle& b : record.blocks) {
    cells.blockAt(b.at);
    cells.markDirty(b.at, 0);
  }
  std::size_t next = 0;
  forEachCell(record.blocks, [&](const LatticeBundle& b, std::size_t bit) {
    CellBlock& block = *cells.find(b.at);
    block.setBelief(bit, record.beliefs[next]);
    if (map.isCompact()) {
      block.setOctants(bit, record.octants[next]);
    } else {
      block.setMean(bit, record.means[next]);
    }
    ++next;
  });
  std::vector<std::uint64_t> regions = cells.regions.keys();
  std::sort(regions.begin(), regions.end());
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

}  // namespace

std::vector<LatticeBundle> bundlesOf(const UnknownSpace& space) {
  std::vector<LatticeBundle> bundles;
  space.forEachBlock([&](const Int3& at, const UnknownSpace::Block& block) {
    bundles.push_back({at, block.free, block.unknown});
  });
  LatticeCoder::sort(3, bundles);
  return bundles;
}

MapRecord recordOf(const MapData& map) {
  MapRecord record;
  record.params = map.params;
  record.trajectory = map.trajectory;
  record.next_plane_id = map.next_plane_id;
  for (const PlaneLayer& layer : map.planes) record.planes.push_back(recordOf(layer));
  recordCells(map.cells, record);
  record.space = bundlesOf(map.unknown);
  return record;
}

MapData mapOf(const MapRecord& record) {
  MapData map;
  map.params = record.params;
  map.trajectory = record.trajectory;
  map.next_plane_id = record.next_plane_id;
  for (const PlaneRecord& plane : record.planes) map.planes.push_back(layerOf(plane));
  restoreCells(record, map);
  map.commit();
  std::vector<UnknownSpace::PlacedBlock> blocks;
  blocks.reserve(record.space.size());
  for (const LatticeBundle& b : record.space) blocks.push_back({b.at, {b.ones, b.twos}});
  map.unknown.add(blocks);
  return map;
}

}  // namespace planar_mapping::detail
