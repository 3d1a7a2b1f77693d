// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "planar_mapping/cuboids/compact_cover.h"
#include "planar_mapping/map/store/key_map.h"

namespace planar_mapping::detail {

/// 4 x 4 x 4 cells of the world grid.
class CellBlock {
 public:
  /// Mean of the points within a cell, in 1/256 of its side.
  using Mean = std::array<std::uint8_t, 3>;

  std::uint64_t occupied() const { return occupied_; }  ///< bit 16 z + 4 y + x
  // Of an occupied cell:
  std::uint8_t belief(std::size_t bit) const { return cells_[rankOf(bit)].belief; }
  /// Eighths of the cell that hold points; only the compact profile keeps them.
  std::uint8_t octants(std::size_t bit) const { return cells_[rankOf(bit)].octants; }
  /// Only the paper's profile, which fits planes to them, keeps means.
  Mean mean(std::size_t bit) const { return cells_[rankOf(bit)].mean; }

  /// Makes the cell occupied if it is not yet; then it has no octants and no mean.
  void setBelief(std::size_t bit, std::uint8_t belief) {
    const std::uint64_t flag = std::uint64_t{1} << bit;
    const std::size_t rank = rankOf(bit);
    if ((occupied_ & flag) == 0) {
      cells_.insert(cells_.begin() + static_cast<std::ptrdiff_t>(rank), Cell());
      occupied_ |= flag;
    }
    cells_[rank].belief = belief;
  }
  void setOctants(std::size_t bit, std::uint8_t octants) { cells_[rankOf(bit)].octants = octants; }
  void setMean(std::size_t bit, const Mean& mean) { cells_[rankOf(bit)].mean = mean; }
  void remove(std::size_t bit) {
    cells_.erase(cells_.begin() + static_cast<std::ptrdiff_t>(rankOf(bit)));
    occupied_ &= ~(std::uint64_t{1} << bit);
  }
  std::size_t memoryBytes() const { return capacityBytes(cells_); }  ///< on the heap

 private:
  struct Cell {
    std::uint8_t belief = 0;
    std::uint8_t octants = 0;
    Mean mean{};
  };
  /// Number of occupied cells before a bit.
  std::size_t rankOf(std::size_t bit) const {
    const std::uint64_t before = occupied_ & ((std::uint64_t{1} << bit) - 1);
    return static_cast<std::size_t>(__builtin_popcountll(before));
  }

  std::uint64_t occupied_ = 0;
  std::vector<Cell> cells_;  ///< of the occupied bits, ascending
};

/// Points of one frame in a block.
struct BlockHits {
  std::array<std::uint32_t, 64> count{};
  std::array<std::uint8_t, 64> octants{};
  std::array<float, 64> belief{};          ///< sum over the points
  std::vector<std::array<float, 3>> mean;  ///< sum of the offsets within the cell, cells
};

/// Cells of the world grid that hold what lies on no plane.
///
/// Cuboids are derived from a cube of kRegionCells^3 cells as a whole; such regions are laid out so
/// that the sensor of the first frame is in the middle of one.
class CellLayer {
 public:
  struct Region {
    KeyMap<CellBlock> blocks;    ///< by block coordinates
    std::uint32_t frame = 0;     ///< that changed it last: leaves extend away from its sensor
    std::uint32_t revision = 0;  ///< of the map, when a cell of the region changed last
    bool dirty = true;           ///< changed since commit()
  };
  KeyMap<Region> regions;  ///< by regionKey()
  Int3 anchor;             ///< first cell of region (0, 0, 0); multiples of 4

  static int bitOf(const Int3& cell) { return 16 * (cell.z & 3) + 4 * (cell.y & 3) + (cell.x & 3); }
  static Int3 blockOf(const Int3& cell) { return {cell.x >> 2, cell.y >> 2, cell.z >> 2}; }
  static Int3 cellOf(const Int3& block, int bit) {
    return {4 * block.x + (bit & 3), 4 * block.y + ((bit >> 2) & 3), 4 * block.z + (bit >> 4)};
  }
  bool empty() const { return regions.empty(); }
  std::uint64_t regionKey(const Int3& block) const;

  /// The block, null if there is none.
  const CellBlock* find(const Int3& block) const;
  CellBlock* find(const Int3& block) {
    return const_cast<CellBlock*>(static_cast<const CellLayer*>(this)->find(block));
  }
  /// The block, which is added if it is new; that may move the others.
  CellBlock& blockAt(const Int3& block) { return regions[regionKey(block)].blocks[packKey(block)]; }
  void markDirty(const Int3& block, std::uint32_t frame);
  /// Stamps the dirty regions with \p revision; forgets blocks and regions without a cell. \return
  /// how many regions were dirty
  std::size_t commit(std::uint32_t revision);

  /// Calls visit(block coordinates, CellBlock) for the blocks of a region, by key.
  template <typename Visit>
  void forEachBlock(std::size_t region, Visit&& visit) const {
    const KeyMap<CellBlock>& blocks = regions.value(region).blocks;
    for (const std::uint64_t key : blocks.sortedKeys()) visit(unpackKey(key), *blocks.find(key));
  }
  template <typename Visit>
  void forEachBlock(Visit&& visit) const {
    for (std::size_t r = 0; r < regions.size(); ++r) forEachBlock(r, visit);
  }
  /// The cells of a region in the order of its blocks.
  std::vector<NonPlanarCell> cellsOf(std::size_t region,
                                     const CuboidApproximationParams& params) const;
  std::size_t memoryBytes() const;
};

constexpr std::int32_t kRegionCells = 64;

}  // namespace planar_mapping::detail
