// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "cell_values.h"
#include "key_map.h"
#include "planar_mapping/core/cuboid_approximation.h"

namespace planar_mapping::detail {

/// 4 x 4 x 4 cells of the world grid.
class CellBlock {
 public:
  /// Mean of the points within a cell, in 1/256 of its side.
  using Mean = std::array<std::uint8_t, 3>;

  CellBlock() = default;
  CellBlock(const CellBlock& other)
      : occupied_(other.occupied_), beliefs_(other.beliefs_), octants_(other.octants_) {
    if (other.hasMeans()) means_ = std::make_unique<Means>(*other.means_);
  }
  CellBlock(CellBlock&& other) noexcept = default;
  CellBlock& operator=(const CellBlock& other) {
    if (this != &other) *this = CellBlock(other);
    return *this;
  }
  CellBlock& operator=(CellBlock&& other) noexcept = default;

  std::uint64_t occupied() const { return occupied_; }  ///< bit 16 z + 4 y + x
  // Of an occupied cell:
  std::uint8_t belief(std::size_t bit) const { return beliefs_.get(occupied_, bit); }
  /// Eighths of the cell that hold points, in the compact profile.
  std::uint8_t octants(std::size_t bit) const { return octants_.get(occupied_, bit); }
  Mean mean(std::size_t bit) const {
    return {(*means_)[0].get(occupied_, bit), (*means_)[1].get(occupied_, bit),
            (*means_)[2].get(occupied_, bit)};
  }
  /// Only the paper's profile, which fits planes to them, keeps means, and no octants.
  bool hasMeans() const { return means_ != nullptr; }

  /// Makes the cell occupied if it is not yet; then it has no octants and no mean.
  void setBelief(std::size_t bit, std::uint8_t belief) {
    const std::uint64_t flag = std::uint64_t{1} << bit;
    if ((occupied_ & flag) != 0) return beliefs_.set(occupied_, bit, belief);
    beliefs_.insert(occupied_, bit, belief);
    octants_.insert(occupied_, bit, 0);
    for (std::size_t axis = 0; hasMeans() && axis < 3; ++axis) {
      (*means_)[axis].insert(occupied_, bit, 0);
    }
    occupied_ |= flag;
  }
  void setOctants(std::size_t bit, std::uint8_t octants) { octants_.set(occupied_, bit, octants); }
  void setMean(std::size_t bit, const Mean& mean) {
    if (!hasMeans()) means_ = std::make_unique<Means>();
    for (std::size_t axis = 0; axis < 3; ++axis) (*means_)[axis].set(occupied_, bit, mean[axis]);
  }
  void remove(std::size_t bit) {
    beliefs_.remove(occupied_, bit);
    octants_.remove(occupied_, bit);
    for (std::size_t axis = 0; hasMeans() && axis < 3; ++axis) {
      (*means_)[axis].remove(occupied_, bit);
    }
    occupied_ &= ~(std::uint64_t{1} << bit);
  }
  /// Beside the block itself.
  std::size_t memoryBytes() const {
    std::size_t bytes = beliefs_.memoryBytes() + octants_.memoryBytes();
    if (!hasMeans()) return bytes;
    for (const CellValues<8>& values : *means_) bytes += values.memoryBytes();
    return bytes + sizeof(Means);
  }

 private:
  using Means = std::array<CellValues<8>, 3>;

  std::uint64_t occupied_ = 0;
  BeliefValues beliefs_;
  CellValues<8> octants_;
  std::unique_ptr<Means> means_;
};

/// Points of one frame in a block.
struct BlockHits {
  std::array<std::uint32_t, 64> count{};
  std::array<std::uint8_t, 64> octants{};
  std::array<float, 64> belief{};          ///< sum over the points
  std::vector<std::array<float, 3>> mean;  ///< sum of the offsets within the cell, cells
  std::uint32_t first_candidate = 0;       ///< planes that may cover points of the block
  std::uint32_t last_candidate = 0;
};

/// Cells of the world grid that hold what lies on no plane.
class CellLayer {
 public:
  KeyMap<CellBlock> blocks;  ///< by cell >> 2

  /// Cuboids are made of a cube of kRegionCells^3 cells as a whole; regions are laid out so that
  /// the sensor of the first frame is in the middle of one.
  struct Region {
    std::vector<std::uint64_t> blocks;  ///< keys; ascending and without repetition after tidy()
    std::uint32_t frame = 0;  ///< the last one that changed it: leaves extend away from its sensor
    std::uint32_t revision = 0;  ///< number of frames in the map when it changed last
    bool dirty = true;           ///< changed since
    bool occupied = false;       ///< holds a cell; known after tidy()
  };
  KeyMap<Region> regions;
  Int3 anchor;  ///< first cell of region (0, 0, 0); multiples of 4

  static int bitOf(const Int3& cell) { return 16 * (cell.z & 3) + 4 * (cell.y & 3) + (cell.x & 3); }
  static Int3 blockOf(const Int3& cell) { return {cell.x >> 2, cell.y >> 2, cell.z >> 2}; }
  static Int3 cellOf(const Int3& block, int bit) {
    return {4 * block.x + (bit & 3), 4 * block.y + ((bit >> 2) & 3), 4 * block.z + (bit >> 4)};
  }
  bool at(const Int3& cell) const;
  std::uint64_t regionKey(const Int3& block) const;
  /// The block, which is added if it is new.
  CellBlock& blockAt(const Int3& block);
  void markDirty(const Int3& block, std::uint32_t frame);
  /// Stamps the dirty regions and forgets empty ones. \return how many were dirty
  std::size_t tidy(std::uint32_t revision);
  /// The cells of a region in the order of its blocks.
  std::vector<NonPlanarCell> cellsOf(const Region& region,
                                     const CuboidApproximationParams& params) const;
  std::size_t memoryBytes() const;
};

constexpr std::int32_t kRegionCells = 64;

}  // namespace planar_mapping::detail
