// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "planar_mapping/core/geometry/cuboid.h"
#include "sensor/depth_image.h"
#include "store/key_map.h"
#include "store/space_region.h"

namespace planar_mapping::detail {

/// 8 x 8 x 8 cells: word z, bit 8 y + x.
using CubeBits = std::array<std::uint64_t, 8>;

/// Which cells of the world grid are hidden behind a surface, and which were seen free (the paper,
/// III-F, Fig. 5c). A cell once seen free is never unknown again, in whatever order frames come;
/// that is why free cells are remembered as well.
///
/// Where nothing nearby was seen free, at the rim of what a frame sees and at its largest range,
/// hidden cells are marked by blocks of 4 x 4 x 4, by the middle of the block: nothing is certain
/// there, and following the rim cell by cell would cost most of the memory. A block of which a
/// frame sees nothing free and part hidden is hidden as a whole.
class UnknownSpace {
 public:
  using Block = SpaceBlock;

  /// Marks the cells in the frustum of an image, up to \p max_range, by its depths.
  void integrate(const DepthImage& image, double cell, double max_range);
  bool isUnknown(const Int3& cell) const { return (around(cell).unknown >> bitOf(cell) & 1u) != 0; }
  struct Surroundings {
    std::uint64_t unknown = 0;    ///< cells of the block of 4 x 4 x 4 around a cell, see bitOf()
    bool region_is_free = false;  ///< nothing is unknown in all of its region of 32 x 32 x 32 cells
  };
  Surroundings around(const Int3& cell) const;
  /// Of a cell in its block.
  static int bitOf(const Int3& cell) { return 16 * (cell.z & 3) + 4 * (cell.y & 3) + (cell.x & 3); }

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
  class OpenRegion;
  class Walk;

  static std::size_t placeOf(const Int3& block) {
    return static_cast<std::size_t>((block.x & 7) + 8 * (block.y & 7) + 64 * (block.z & 7));
  }
  static std::uint64_t regionOf(const Int3& block) {
    return packKey(Int3{block.x >> 3, block.y >> 3, block.z >> 3});
  }

  KeyMap<SpaceRegion> regions_;  ///< by cell >> 5
};

template <typename Visit>
void UnknownSpace::forEachBlock(Visit&& visit) const {
  SpaceRegion::Blocks blocks;
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    const Int3 at = unpackKey(regions_.key(r));
    regions_.value(r).unpack(blocks);
    for (std::size_t i = 0; i < blocks.labels.size(); ++i) {
      if (blocks.labels[i] == SpaceRegion::kNever) continue;
      visit(Int3{8 * at.x + static_cast<std::int32_t>(i & 7u),
                 8 * at.y + static_cast<std::int32_t>(i >> 3u & 7u),
                 8 * at.z + static_cast<std::int32_t>(i >> 6u)},
            blocks.cellsOf(i));
    }
  }
}

/// The cells of one kind: free or unknown, whatever occupies them.
KeyMap<CubeBits> cellsOf(const UnknownSpace& space, std::uint64_t UnknownSpace::Block::*kind);

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
