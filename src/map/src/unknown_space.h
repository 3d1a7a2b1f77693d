// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "depth_image.h"
#include "key_map.h"

namespace planar_mapping::detail {

/// 8 x 8 x 8 cells: word z, bit 8 y + x.
using CubeBits = std::array<std::uint64_t, 8>;

/// Which cells of the world grid are hidden behind a surface, and which were seen free (the paper,
/// III-F, Fig. 5c). A cell once seen free is never unknown again, in whatever order frames come;
/// that is why free cells are remembered as well.
///
/// Where nothing nearby was seen free, at the rim of what a frame sees and at its largest range,
/// hidden cells are judged by blocks of 4 x 4 x 4, by the middle of the block: nothing is certain
/// there, and following the rim cell by cell would cost most of the memory. A block of which a
/// frame sees nothing free and part hidden is hidden as a whole.
class UnknownSpace {
 public:
  /// 4 x 4 x 4 cells, bit 16 z + 4 y + x.
  struct Block {
    std::uint64_t free = 0;
    std::uint64_t unknown = 0;
  };

  /// Judges the cells in the frustum of an image, up to \p max_range, by its depths.
  void integrate(const DepthImage& image, double cell, double max_range);
  bool isUnknown(const Int3& cell) const;

  /// Calls visit(block coordinates, Block) for every block of which something is known, in the
  /// order in which their regions were seen first.
  template <typename Visit>
  void forEachBlock(Visit&& visit) const;
  struct PlacedBlock {
    Int3 at;
    Block cells;
  };
  /// Adds what a file says of blocks; best region by region.
  void add(const std::vector<PlacedBlock>& blocks);
  std::size_t memoryBytes() const;

 private:
  static constexpr std::int32_t kRegionBlocks = 8;  ///< a side
  enum Label : std::uint8_t { kNever, kFree, kUnknown, kMixed };
  /// 32 x 32 x 32 cells: a label of two bits for each block, the cells of the mixed ones in order.
  struct Region {
    std::array<std::uint64_t, 16> labels{};
    std::vector<Block> mixed;

    unsigned label(std::size_t block) const {
      return static_cast<unsigned>(labels[block >> 5u] >> (2 * (block & 31u))) & 3u;
    }
    /// Position in mixed of a block with that label.
    std::size_t rank(std::size_t block) const;
  };
  class OpenRegion;
  class Walk;

  static std::size_t placeOf(const Int3& block) {
    return static_cast<std::size_t>((block.x & 7) + 8 * (block.y & 7) + 64 * (block.z & 7));
  }
  static std::uint64_t regionOf(const Int3& block) {
    return packKey(Int3{block.x >> 3, block.y >> 3, block.z >> 3});
  }
  /// Bits of the blocks of a word of labels that are mixed, at the low bits of their labels.
  static std::uint64_t mixedOf(std::uint64_t labels) {
    return labels & (labels >> 1u) & 0x5555555555555555u;
  }

  KeyMap<Region> regions_;  ///< by cell >> 5
};

template <typename Visit>
void UnknownSpace::forEachBlock(Visit&& visit) const {
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    const Region& region = regions_.value(r);
    const Int3 at = unpackKey(regions_.key(r));
    std::size_t next = 0;
    for (std::size_t i = 0; i < 512; ++i) {
      const unsigned label = region.label(i);
      if (label == kNever) continue;
      const Int3 block{kRegionBlocks * at.x + static_cast<std::int32_t>(i & 7u),
                       kRegionBlocks * at.y + static_cast<std::int32_t>(i >> 3u & 7u),
                       kRegionBlocks * at.z + static_cast<std::int32_t>(i >> 6u)};
      visit(block, label == kMixed  ? region.mixed[next++]
                   : label == kFree ? Block{kAll, 0}
                                    : Block{0, kAll});
    }
  }
}

/// The unknown cells whose centre no cuboid occupies.
/// \param cell side of a cell, metres
KeyMap<CubeBits> unknownCells(const UnknownSpace& space, const std::vector<Cuboid>& occupied,
                              double cell);

/// Box of unknown cells, low and size in cells.
struct CellBlockBox {
  Int3 low;
  Int3 size;
};
/// Covers the cells of the cubes exactly with disjoint boxes, greedily along x, y, z.
std::vector<CellBlockBox> mergeToBoxes(const KeyMap<CubeBits>& cubes);

}  // namespace planar_mapping::detail
