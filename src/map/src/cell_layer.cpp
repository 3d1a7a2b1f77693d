// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cell_layer.h"

#include <algorithm>

#include "belief.h"
#include "map_data.h"

namespace planar_mapping::detail {
namespace {

constexpr std::int32_t kRegionBlocks = kRegionCells / 4;

std::int32_t floorDivide(std::int32_t value, std::int32_t divisor) {
  return value >= 0 ? value / divisor : -((divisor - 1 - value) / divisor);
}

}  // namespace

bool CellLayer::at(const Int3& cell) const {
  const CellBlock* block = blocks.find(packKey(blockOf(cell)));
  return block != nullptr && ((block->occupied() >> bitOf(cell)) & 1u) != 0;
}

std::uint64_t CellLayer::regionKey(const Int3& block) const {
  return packKey(Int3{floorDivide(block.x - anchor.x / 4, kRegionBlocks),
                      floorDivide(block.y - anchor.y / 4, kRegionBlocks),
                      floorDivide(block.z - anchor.z / 4, kRegionBlocks)});
}

CellBlock& CellLayer::blockAt(const Int3& block) {
  const std::uint64_t key = packKey(block);
  if (CellBlock* found = blocks.find(key)) return *found;
  regions[regionKey(block)].blocks.push_back(key);
  return blocks[key];
}

void CellLayer::markDirty(const Int3& block, std::uint32_t frame) {
  Region& region = regions[regionKey(block)];
  region.dirty = true;
  region.frame = frame;
}

std::size_t CellLayer::tidy(std::uint32_t revision) {
  std::size_t changed = 0;
  std::size_t stale = 0;
  bool any_empty = false;
  for (std::size_t r = 0; r < regions.size(); ++r) {
    Region& region = regions.value(r);
    if (!region.dirty) continue;
    region.dirty = false;
    region.revision = revision;
    region.occupied = false;
    ++changed;
    // In the order of the keys: a reloaded map must give the same cuboids.
    std::sort(region.blocks.begin(), region.blocks.end());
    region.blocks.erase(std::unique(region.blocks.begin(), region.blocks.end()),
                        region.blocks.end());
    region.blocks.erase(
        std::remove_if(region.blocks.begin(), region.blocks.end(),
                       [&](std::uint64_t key) { return blocks.find(key) == nullptr; }),
        region.blocks.end());
    for (const std::uint64_t key : region.blocks) {
      const bool occupied = blocks.find(key)->occupied() != 0;
      stale += occupied ? 0 : 1;
      region.occupied |= occupied;
    }
    any_empty |= !region.occupied;
  }
  // Blocks that lost their last cell go when they are worth the walk over all others.
  constexpr std::size_t kShare = 16;
  if (any_empty || stale > blocks.size() / kShare) {
    regions.removeIf([](std::uint64_t, const Region& region) { return !region.occupied; });
    blocks.removeIf([](std::uint64_t, const CellBlock& block) { return block.occupied() == 0; });
  }
  return changed;
}

std::vector<NonPlanarCell> CellLayer::cellsOf(const Region& region,
                                              const CuboidApproximationParams& params) const {
  std::vector<NonPlanarCell> cells;
  for (const std::uint64_t key : region.blocks) {
    const CellBlock* block = blocks.find(key);
    if (block == nullptr) continue;
    for (std::uint64_t bits = block->occupied(); bits != 0; bits &= bits - 1) {
      const auto bit = static_cast<std::size_t>(__builtin_ctzll(bits));
      const Int3 c = cellOf(unpackKey(key), static_cast<int>(bit));
      NonPlanarCell cell;
      cell.x = c.x;
      cell.y = c.y;
      cell.z = c.z;
      Vector3 within(0.5, 0.5, 0.5);
      if (block->hasMeans()) {
        const CellBlock::Mean& m = block->mean(bit);
        within = Vector3(m[0] + 0.5, m[1] + 0.5, m[2] + 0.5) / 256.0;
      }
      cell.mean = params.resolution * (Vector3(c.x, c.y, c.z) + within);
      cell.weight = static_cast<float>(params.min_points_per_cell);  // it passed that test
      if (!block->hasMeans()) cell.octants = block->octants(bit);
      cell.probability = beliefOf(block->belief(bit));
      cells.push_back(cell);
    }
  }
  return cells;
}

std::size_t CellLayer::memoryBytes() const {
  std::size_t bytes = blocks.memoryBytes() + regions.memoryBytes();
  for (std::size_t i = 0; i < blocks.size(); ++i) bytes += blocks.value(i).memoryBytes();
  for (std::size_t r = 0; r < regions.size(); ++r) {
    bytes += regions.value(r).blocks.capacity() * sizeof(std::uint64_t);
  }
  return bytes;
}

}  // namespace planar_mapping::detail
