// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "sections.h"

namespace planar_mapping::detail {
void writeCells(const MapData& map, ByteWriter& out) {
  const CellLayer& cells = map.cells;
  out.zigzag(cells.anchor.x / 4);
  out.zigzag(cells.anchor.y / 4);
  out.zigzag(cells.anchor.z / 4);
  std::vector<CellBundle> bundles;
  for (std::size_t i = 0; i < cells.blocks.size(); ++i) {
    const std::uint64_t occupied = cells.blocks.value(i).occupied();
    if (occupied != 0) bundles.push_back({unpackKey(cells.blocks.key(i)), occupied});
  }
  writeTree(TreeKind::Octree, bundles, Label::Occupied, out);
  std::vector<std::uint8_t> beliefs;
  std::vector<std::uint8_t> octants;
  std::vector<std::uint8_t> means;
  forEachCell(TreeKind::Octree, bundles, [&](const CellBundle& b, int bit) {
    const CellBlock& block = *cells.blocks.find(packKey(b.at));
    const auto at = static_cast<std::size_t>(bit);
    beliefs.push_back(block.belief(at));
    if (!block.hasMeans()) return octants.push_back(block.octants(at));
    const CellBlock::Mean mean = block.mean(at);
    means.insert(means.end(), mean.begin(), mean.end());
  });
  writeRuns(beliefs, out);
  for (const std::uint8_t m : map.isCompact() ? octants : means) out.u8(m);
  std::vector<std::uint64_t> regions;
  for (std::size_t r = 0; r < cells.regions.size(); ++r) {
    if (cells.regions.value(r).occupied) regions.push_back(cells.regions.key(r));
  }
  std::sort(regions.begin(), regions.end());
  for (const std::uint64_t key : regions) out.varint(cells.regions.find(key)->frame);
}

void readCells(MapData& map, ByteReader& in) {
  CellLayer& cells = map.cells;
  cells.anchor.x = 4 * in.within(-kLatticeLimit / 2, kLatticeLimit / 2);
  cells.anchor.y = 4 * in.within(-kLatticeLimit / 2, kLatticeLimit / 2);
  cells.anchor.z = 4 * in.within(-kLatticeLimit / 2, kLatticeLimit / 2);
  const std::vector<CellBundle> bundles = readTree(TreeKind::Octree, Label::Occupied, in);
  for (const CellBundle& b : bundles) {
    cells.blockAt(b.at);
    cells.markDirty(b.at, 0);
  }
  std::vector<std::uint8_t> beliefs;
  readRuns(countCells(bundles), in, [&](std::uint8_t value) { beliefs.push_back(value); });
  std::size_t i = 0;
  forEachCell(TreeKind::Octree, bundles, [&](const CellBundle& b, int bit) {
    CellBlock& block = *cells.blocks.find(packKey(b.at));
    const auto at = static_cast<std::size_t>(bit);
    block.setBelief(at, beliefs[i++]);
    if (map.isCompact()) {
      const std::uint8_t octants = in.u8();
      if (octants == 0) in.fail("has a cell that holds no point");
      block.setOctants(at, octants);
      return;
    }
    const std::uint8_t* mean = in.take(3);
    block.setMean(at, {mean[0], mean[1], mean[2]});
  });
  std::vector<std::uint64_t> regions = cells.regions.keys();
  std::sort(regions.begin(), regions.end());
  for (const std::uint64_t key : regions) {
    const std::uint64_t frame = in.varint();
    if (frame >= map.trajectory.size()) in.fail("names a frame that is not in the trajectory");
    cells.regions.find(key)->frame = static_cast<std::uint32_t>(frame);
  }
  in.end();
}

void writeSpace(const MapData& map, bool free, ByteWriter& out) {
  std::vector<CellBundle> bundles;
  map.unknown.forEachBlock([&](const Int3& at, const UnknownSpace::Block& block) {
    const std::uint64_t cells = free ? block.free : block.unknown;
    if (cells != 0) bundles.push_back({at, cells});
  });
  writeTree(TreeKind::Space, bundles, free ? Label::Occupied : Label::Unknown, out);
}

void readSpace(MapData& map, bool free, ByteReader& in) {
  readTree(TreeKind::Space, free ? Label::Occupied : Label::Unknown, in, [&](const CellBundle& b) {
    map.unknown.add(b.at, free ? UnknownSpace::Block{b.cells, 0} : UnknownSpace::Block{0, b.cells});
  });
  in.end();
}

}  // namespace planar_mapping::detail
