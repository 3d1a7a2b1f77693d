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

std::size_t CellLayer::rebuild(const CuboidApproximationParams& params,
                               const std::vector<StoredPose>& trajectory) {
  std::size_t rebuilt = 0;
  std::size_t stale = 0;
  bool any_empty = false;
  std::vector<NonPlanarCell> cells;
  for (std::size_t r = 0; r < regions.size(); ++r) {
    Region& region = regions.value(r);
    if (!region.dirty) continue;
    region.dirty = false;
    ++rebuilt;
    // In the order of the keys: a reloaded map must give the same cuboids.
    std::sort(region.blocks.begin(), region.blocks.end());
    region.blocks.erase(std::unique(region.blocks.begin(), region.blocks.end()),
                        region.blocks.end());
    region.blocks.erase(
        std::remove_if(region.blocks.begin(), region.blocks.end(),
                       [&](std::uint64_t key) { return blocks.find(key) == nullptr; }),
        region.blocks.end());
    cells.clear();
    for (const std::uint64_t key : region.blocks) {
      const CellBlock* found = blocks.find(key);
      if (found == nullptr) continue;
      const CellBlock& block = *found;
      stale += block.occupied() == 0 ? 1 : 0;
      for (std::uint64_t bits = block.occupied(); bits != 0; bits &= bits - 1) {
        const int bit = __builtin_ctzll(bits);
        const Int3 c = cellOf(unpackKey(key), bit);
        NonPlanarCell cell;
        cell.x = c.x;
        cell.y = c.y;
        cell.z = c.z;
        Vector3 within(0.5, 0.5, 0.5);
        if (block.hasMeans()) {
          const CellBlock::Mean& m = block.mean(static_cast<std::size_t>(bit));
          within = Vector3(m[0] + 0.5, m[1] + 0.5, m[2] + 0.5) / 256.0;
        }
        cell.mean = params.resolution * (Vector3(c.x, c.y, c.z) + within);
        cell.weight = static_cast<float>(params.min_points_per_cell);  // it passed that test
        if (!block.hasMeans()) cell.octants = block.octants(static_cast<std::size_t>(bit));
        cell.probability = beliefOf(block.belief(static_cast<std::size_t>(bit)));
        cells.push_back(cell);
      }
    }
    region.cuboids.clear();
    if (cells.empty()) {
      any_empty = true;
      continue;
    }
    const Vector3 sensor = region.frame < trajectory.size() ? trajectory[region.frame].sensor()
                                                            : Vector3(Vector3::Zero());
    region.cuboids = cuboidsOfCells(cells, params, sensor);
  }
  // Blocks that lost their last cell go when they are worth the walk over all others.
  constexpr std::size_t kShare = 16;
  if (any_empty || stale > blocks.size() / kShare) {
    regions.removeIf([](std::uint64_t, const Region& region) { return region.cuboids.empty(); });
    blocks.removeIf([](std::uint64_t, const CellBlock& block) { return block.occupied() == 0; });
  }
  return rebuilt;
}

std::size_t CellLayer::memoryBytes() const {
  std::size_t bytes = blocks.memoryBytes() + regions.memoryBytes();
  for (std::size_t i = 0; i < blocks.size(); ++i) bytes += blocks.value(i).memoryBytes();
  for (std::size_t r = 0; r < regions.size(); ++r) {
    bytes += regions.value(r).cuboids.capacity() * sizeof(Cuboid) +
             regions.value(r).blocks.capacity() * sizeof(std::uint64_t);
  }
  return bytes;
}

}  // namespace planar_mapping::detail
