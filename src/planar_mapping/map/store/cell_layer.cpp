// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/store/cell_layer.h"

#include "planar_mapping/map/store/belief.h"

namespace planar_mapping::detail {

std::uint64_t CellLayer::regionKey(const Int3& block) const {
  static_assert(kRegionCells == 64);
  return packKey(Int3{(block.x - anchor.x / 4) >> 4, (block.y - anchor.y / 4) >> 4,
                      (block.z - anchor.z / 4) >> 4});
}

const CellBlock* CellLayer::find(const Int3& block) const {
  const Region* region = regions.find(regionKey(block));
  return region == nullptr ? nullptr : region->blocks.find(packKey(block));
}

void CellLayer::markDirty(const Int3& block, std::uint32_t frame) {
  Region& region = regions[regionKey(block)];
  region.dirty = true;
  region.frame = frame;
}

std::size_t CellLayer::commit(std::uint32_t revision) {
  std::size_t modified = 0;
  for (Region& region : regions.values()) {
    if (!region.dirty) continue;
    region.blocks.removeIf([](std::uint64_t, const CellBlock& b) { return b.occupied() == 0; });
    region.revision = revision;
    region.dirty = false;
    ++modified;
  }
  regions.removeIf([](std::uint64_t, const Region& region) { return region.blocks.empty(); });
  return modified;
}

std::vector<NonPlanarCell> CellLayer::cellsOf(std::size_t region,
                                              const CuboidApproximationParams& params) const {
  std::vector<NonPlanarCell> cells;
  const bool has_means = params.profile == Profile::Paper;
  forEachBlock(region, [&](const Int3& at, const CellBlock& block) {
    forEachBit(block.occupied(), [&](std::size_t bit) {
      const Int3 c = cellOf(at, static_cast<int>(bit));
      NonPlanarCell cell;
      cell.x = c.x;
      cell.y = c.y;
      cell.z = c.z;
      Vector3 within(0.5, 0.5, 0.5);
      if (has_means) {
        const CellBlock::Mean m = block.mean(bit);
        within = Vector3(m[0] + 0.5, m[1] + 0.5, m[2] + 0.5) / 256.0;
      }
      cell.mean = params.resolution * (Vector3(c.x, c.y, c.z) + within);
      cell.weight = static_cast<float>(params.min_points_per_cell);  // it passed that test
      if (!has_means) cell.octants = block.octants(bit);
      cell.probability = beliefOf(block.belief(bit));
      cells.push_back(cell);
    });
  });
  return cells;
}

std::size_t CellLayer::memoryBytes() const {
  std::size_t bytes = regions.memoryBytes();
  for (const Region& region : regions.values()) {
    bytes += region.blocks.memoryBytes();
    for (const CellBlock& block : region.blocks.values()) bytes += block.memoryBytes();
  }
  return bytes;
}

}  // namespace planar_mapping::detail
