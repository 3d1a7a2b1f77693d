// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "planar_mapping/map/file/columns.h"
#include "planar_mapping/map/store/key_map.h"

namespace planar_mapping::detail {

/// Labels of 64 cells, two bits each: a tile of 8 x 8 (bit 8 b + a) or a block of 4 x 4 x 4
/// (bit 16 z + 4 y + x).
struct CellLabels {
  Int3 at;  ///< in tiles or blocks; z = 0 for tiles
  std::uint64_t low = 0;
  std::uint64_t high = 0;
};

/// What labels mean (the paper, IV).
enum Label : std::uint8_t { kFree = 0, kOccupied = 1, kUnknown = 2, kInner = 3 };

/// Labels of the cells of lattices, as a file holds them (docs/file_format.md, "Label trees"): one
/// for a region of 8 x 8 (x 8) tiles or blocks where all of its cells are alike, else kInner and
/// one for each of these, else one for each cell.
class LabelTree {
 public:
  /// \param dimensions 2 for tiles, 3 for blocks
  explicit LabelTree(int dimensions) : dimensions_(dimensions) {}

  Int3 regionOf(const Int3& bundle) const;
  /// Adds the regions of a lattice, or the next one of it, and sorts the bundles into the order of
  /// Walk. Cells that no bundle tells of have the label \p background.
  void add(std::vector<CellLabels>& bundles, Label background);
  /// Adds a region after all others; with kInner its tiles or blocks are to follow.
  void addRegion(const Int3& region, Label label);
  std::size_t regions() const { return regions_.size(); }
  /// How many cells are occupied.
  std::uint64_t occupied() const;
  /// Writes or reads the tree. \throws Error
  void code(Columns& columns);

  /// Goes through regions in their order.
  class Walk {
   public:
    explicit Walk(const LabelTree& tree) : tree_(tree) {}
    /// Passes the next region if all its cells are alike. \return was it
    bool passAlike(Int3& region, Label& label) {
      if (tree_.region_labels_[region_] == kInner) return false;
      const auto& at = tree_.regions_[region_];
      region = {at[0], at[1], at[2]};
      label = static_cast<Label>(tree_.region_labels_[region_++]);
      return true;
    }
    /// Calls visit(CellLabels) for the tiles or blocks of the next region.
    template <typename Visit>
    void next(Visit&& visit) {
      const auto& region = tree_.regions_[region_];
      const std::uint8_t label = tree_.region_labels_[region_++];
      for (std::size_t i = 0; i < tree_.bundlesPerRegion(); ++i) {
        const std::uint8_t own = label == kInner ? tree_.bundle_labels_[bundle_++] : label;
        const Bits bits = own == kInner ? tree_.cells_[cells_++] : bitsOf(own);
        const auto place = static_cast<std::int32_t>(i);
        visit(CellLabels{{kSide * region[0] + (place & 7), kSide * region[1] + (place >> 3 & 7),
                          kSide * region[2] + (place >> 6)},
                         bits.low,
                         bits.high});
      }
    }

   private:
    const LabelTree& tree_;
    std::size_t region_ = 0;
    std::size_t bundle_ = 0;
    std::size_t cells_ = 0;
  };

 private:
  struct Bits {
    std::uint64_t low = 0;
    std::uint64_t high = 0;
  };
  static constexpr std::int32_t kSide = 8;  ///< of a region, in tiles or blocks
  static Bits bitsOf(std::uint8_t label);
  std::size_t bundlesPerRegion() const { return dimensions_ == 2 ? 64 : 512; }
  static std::size_t placeOf(const Int3& bundle) {
    return static_cast<std::size_t>((bundle.x & 7) + 8 * (bundle.y & 7) + 64 * (bundle.z & 7));
  }

  int dimensions_;
  std::vector<std::array<std::int16_t, 3>> regions_;
  std::vector<std::uint8_t> region_labels_;
  std::vector<std::uint8_t> bundle_labels_;  ///< of the inner regions
  std::vector<Bits> cells_;                  ///< of the inner bundles
};

}  // namespace planar_mapping::detail
