// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "sections.h"

namespace planar_mapping::detail {
namespace {

/// The blocks of 4 x 4 x 4 cells of the cubes of 8 x 8 x 8.
std::vector<CellBundle> toBundles(const UnknownSpace& space, bool free) {
  std::vector<CellBundle> bundles;
  for (std::size_t i = 0; i < space.cubes(); ++i) {
    const UnknownSpace::Cube cube = space.cube(i);
    const CubeBits& bits = free ? cube.free : cube.unknown;
    const Int3 at = unpackKey(space.key(i));
    for (int part = 0; part < 8; ++part) {
      const int x = part & 1, y = (part >> 1) & 1, z = part >> 2;
      CellBundle b{{2 * at.x + x, 2 * at.y + y, 2 * at.z + z}, 0};
      for (int slice = 0; slice < 4; ++slice) {
        const std::uint64_t rows =
            bits[static_cast<std::size_t>(4 * z + slice)] >> (32 * y + 4 * x);
        for (int row = 0; row < 4; ++row) {
          b.cells |= ((rows >> (8 * row)) & 0xfu) << (16 * slice + 4 * row);
        }
      }
      if (b.cells != 0) bundles.push_back(b);
    }
  }
  return bundles;
}

}  // namespace

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
  std::vector<CellBundle> bundles = toBundles(map.unknown, free);
  writeTree(TreeKind::Space, bundles, free ? Label::Occupied : Label::Unknown, out);
}

void readSpace(MapData& map, bool free, ByteReader& in) {
  readTree(TreeKind::Space, free ? Label::Occupied : Label::Unknown, in, [&](const CellBundle& b) {
    CubeBits bits{};
    const int x = b.at.x & 1, y = b.at.y & 1, z = b.at.z & 1;
    for (int slice = 0; slice < 4; ++slice) {
      std::uint64_t rows = 0;
      for (int row = 0; row < 4; ++row) {
        rows |= ((b.cells >> (16 * slice + 4 * row)) & 0xfu) << (8 * row);
      }
      bits[static_cast<std::size_t>(4 * z + slice)] = rows << (32 * y + 4 * x);
    }
    const Int3 cube{b.at.x >> 1, b.at.y >> 1, b.at.z >> 1};
    if (free) {
      map.unknown.addFree(cube, bits);
    } else {
      map.unknown.addUnknown(cube, bits);
    }
  });
  in.end();
}

}  // namespace planar_mapping::detail
