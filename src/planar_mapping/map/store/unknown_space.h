// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "planar_mapping/geometry/cuboid.h"
#include "planar_mapping/map/sensor/depth_image.h"
#include "planar_mapping/map/store/key_map.h"
#include "planar_mapping/map/store/planar_map_params.h"
#include "planar_mapping/map/store/space_region.h"

namespace planar_mapping::detail {

/// 8 x 8 x 8 cells: word z, bit 8 y + x.
using CubeBits = std::array<std::uint64_t, 8>;

/// Space deeper than that many cells is not classified: a frame would ask for gigabytes.
constexpr double kMaxRangeCells = 2048.0;

/// What the images of a frame may cost together. What is too much is not classified: far space
/// first.
struct SpaceBudget {
  /// Rays of a sparse image pass so many cells; some 30 bytes each while a frame is integrated.
  double ray_cells = 1 << 25;
  /// Regions of 32 x 32 x 32 cells that they may pass: of lone rays each has its own.
  std::size_t regions = std::size_t{1} << 14;
  /// Cubes looked at; of the last half only those of 32 x 32 x 32 cells, as a whole.
  std::size_t cubes = std::size_t{1} << 24;
  /// Metres from the sensor up to which all was classified.
  double range = std::numeric_limits<double>::infinity();
};

/// Which cells of the world grid were seen free, in whatever order frames come, and, where space is
/// free unless something says otherwise, which are hidden behind a surface (the paper, III-F,
/// Fig. 5c). A cell once seen free is never unknown again.
///
/// A cell is seen free if it is clear in a depth image (DepthImage::clearCells()), or if a ray
/// passes it close to the sensor, where few cells are as small as the view. What is so far away
/// that a block of 4 x 4 x 4 cells is less than kFarBlock of its distance is free as a block or not
/// at all: only if every pixel over it is clear. Of measurements with gaps between them (a sparse
/// image) only the cells that their rays pass are free.
///
/// Where nothing nearby was seen free, at the rim of what a frame sees and at its largest range,
/// hidden cells are marked by blocks, by the middle of the block: nothing is certain there, and
/// following the rim cell by cell would cost most of the memory. A block of which a frame sees
/// nothing free and part hidden is hidden as a whole.
class UnknownSpace {
 public:
  using Block = SpaceBlock;
  static constexpr int kBlockLevel = 2;   ///< a block has 2^2 cells a side
  static constexpr int kRegionLevel = 5;  ///< and a region 2^5

  explicit UnknownSpace(Unseen unseen = Unseen::Unknown) : unseen_(unseen) {}

  /// Marks the cells in the frustum of an image by its depths; those that are hidden up to
  /// \p max_range.
  void integrate(const DepthImage& image, double cell, double max_range, SpaceBudget& budget);
  bool isUnknown(const Int3& cell) const { return (around(cell).unknown >> bitOf(cell) & 1u) != 0; }
  struct Surroundings {
    std::uint64_t unknown = 0;     ///< cells of the block of 4 x 4 x 4 around a cell, see bitOf()
    bool region_is_alike = false;  ///< all of its region of 32 x 32 x 32 cells is as this cell
  };
  Surroundings around(const Int3& cell) const;
  /// Is a place unknown of which nothing was ever seen?
  bool isUnseenUnknown() const { return unseen_ == Unseen::Unknown; }
  bool empty() const { return regions_.empty(); }
  /// Of a cell in its block.
  static int bitOf(const Int3& cell) { return 16 * (cell.z & 3) + 4 * (cell.y & 3) + (cell.x & 3); }

  /// Calls visit(block coordinates, Block) for every block of regions of which something is
  /// stored, region by region in the order of Int3.
  template <typename Visit>
  void forEachBlock(Visit&& visit) const {
    forEachRegion(
        [&](const Int3& at, const SpaceRegion& region) { forEachBlock(at, region, visit); });
  }
  template <typename Visit>
  void forEachBlock(const Int3& at, const SpaceRegion& region, Visit&& visit) const {
    SpaceRegion::Blocks blocks;
    region.unpack(blocks);
    for (std::size_t i = 0; i < blocks.labels.size(); ++i) {
      if (blocks.labels[i] == SpaceRegion::kNever && !isUnseenUnknown()) continue;
      visit(Int3{8 * at.x + static_cast<std::int32_t>(i & 7u),
                 8 * at.y + static_cast<std::int32_t>(i >> 3u & 7u),
                 8 * at.z + static_cast<std::int32_t>(i >> 6u)},
            blocks.cellsOf(i));
    }
  }
  /// Calls visit(cell coordinates >> 5, SpaceRegion) for every region of which something is stored,
  /// in the order of Int3.
  template <typename Visit>
  void forEachRegion(Visit&& visit) const {
    for (const std::uint64_t key : regions_.sortedKeys())
      visit(unpackKey(key), *regions_.find(key));
  }
  /// Null if nothing is stored of it. \param at cell coordinates >> 5
  const SpaceRegion* region(const Int3& at) const { return regions_.find(packKey(at)); }
  void setRegion(const Int3& at, const SpaceRegion& region) { regions_[packKey(at)] = region; }
  struct PlacedBlock {
    Int3 at;
    Block cells;
  };
  /// Adds what a file or another map says of blocks; best region by region.
  void add(const std::vector<PlacedBlock>& blocks);
  /// Adds what a file or another map says of a region, which stays as it is stored where it can.
  /// \param at cell coordinates >> 5
  void add(const Int3& at, const SpaceRegion& region);
  /// Adds all that another map says.
  void add(const UnknownSpace& other);
  std::size_t memoryBytes() const;

 private:
  class OpenRegion;
  class Walk;

  static void keepNearest(const Vector3& origin, double cell, std::vector<PlacedBlock>& blocks,
                          SpaceBudget& budget);
  void integrateRays(const DepthImage& image, double cell, SpaceBudget& budget);
  /// Is all of the region free that has this cell?
  bool isFreeRegion(const Int3& cell) const {
    const SpaceRegion* region = regions_.find(regionOf(blockOf(cell)));
    return region != nullptr && region->isAllFree();
  }
  static Int3 blockOf(const Int3& cell) { return {cell.x >> 2, cell.y >> 2, cell.z >> 2}; }
  static std::size_t placeOf(const Int3& block) {
    return static_cast<std::size_t>((block.x & 7) + 8 * (block.y & 7) + 64 * (block.z & 7));
  }
  static std::uint64_t regionOf(const Int3& block) {
    return packKey(Int3{block.x >> 3, block.y >> 3, block.z >> 3});
  }

  Unseen unseen_;
  KeyMap<SpaceRegion> regions_;  ///< by cell >> 5
};

/// A box of space, metres.
struct SpaceBox {
  Vector3 low = Vector3::Constant(-std::numeric_limits<double>::infinity());
  Vector3 high = Vector3::Constant(std::numeric_limits<double>::infinity());
};
/// Cells of a state.
struct SpaceCells {
  KeyMap<CubeBits> cubes;        ///< by cell >> 3
  KeyMap<std::uint8_t> regions;  ///< of 32 x 32 x 32 cells that all are, by cell >> 5

  std::size_t count() const;
};
/// The free or unknown cells of a box, by their centres, that no cuboid occupies; only in regions
/// of which something is stored. \param cell side of a cell, metres
/// \throws InputError if more than 32,768 regions that are alike are cut by cuboids or by the box
SpaceCells spaceCells(const UnknownSpace& space, CellState state, const SpaceBox& box,
                      const std::vector<Cuboid>& occupied, double cell);

/// Box of cells, low and size in cells.
struct CellBlockBox {
  Int3 low;
  Int3 size;
};
/// Covers the cells exactly with disjoint boxes, greedily along x, y, z: whole regions first.
std::vector<CellBlockBox> mergeToBoxes(const SpaceCells& cells);

}  // namespace planar_mapping::detail
