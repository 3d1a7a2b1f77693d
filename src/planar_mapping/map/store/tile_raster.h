// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/map/store/key_map.h"

namespace planar_mapping::detail {

/// 8 x 8 cells of a plane's raster.
class RasterTile {
 public:
  std::uint64_t occupied() const { return occupied_; }  ///< bit 8 b + a
  /// Of an occupied cell.
  std::uint8_t belief(std::size_t bit) const { return beliefs_[bit]; }
  /// Makes the cell occupied if it is not yet.
  void setBelief(std::size_t bit, std::uint8_t belief) {
    occupied_ |= std::uint64_t{1} << bit;
    beliefs_[bit] = belief;
  }
  void remove(std::size_t bit) { occupied_ &= ~(std::uint64_t{1} << bit); }

 private:
  std::uint64_t occupied_ = 0;
  std::array<std::uint8_t, 64> beliefs_{};
};

/// A tile and its coordinates.
struct PlacedTile {
  std::int32_t a = 0;
  std::int32_t b = 0;
  const RasterTile* tile = nullptr;
};

/// Tiles [low, high]; none if low > high.
struct TileWindow {
  std::int32_t low_a = kLatticeLimit;
  std::int32_t low_b = kLatticeLimit;
  std::int32_t high_a = -kLatticeLimit;
  std::int32_t high_b = -kLatticeLimit;

  bool empty() const { return low_a > high_a; }
  void include(std::int32_t a, std::int32_t b) {
    low_a = std::min(low_a, a);
    low_b = std::min(low_b, b);
    high_a = std::max(high_a, a);
    high_b = std::max(high_b, b);
  }
  void include(const TileWindow& other) {
    include(other.low_a, other.low_b);
    include(other.high_a, other.high_b);
  }
};

/// A block of kPatchCells x kPatchCells cells: the unit in which cuboids are derived, so that the
/// cost of a frame does not grow with the plane. Patches start at the middle of what was seen
/// first, and what one frame sees of a plane rarely reaches beyond one.
struct RasterPatch {
  static constexpr std::int32_t kTiles = 16;  ///< along a side

  std::uint64_t key = 0;
  std::uint32_t revision = 0;  ///< of the map, when a cell of the patch changed last
  bool dirty = false;          ///< changed since commit()
  TileWindow window;           ///< holds the tiles that have a cell; tight unless dirty
};
constexpr std::int32_t kPatchCells = 8 * RasterPatch::kTiles;

/// The occupied cells of a plane with their beliefs: a sparse raster of tiles.
///
/// Cell (a, b) spans [a s, (a + 1) s) x [b s, (b + 1) s) along u and v of the plane's frame; tile
/// (a, b) has the cells 8 a to 8 a + 7 and 8 b to 8 b + 7.
class TileRaster {
 public:
  /// First tile of patch (0, 0). Only where there is no tile yet.
  void setAnchor(std::int32_t tile_a, std::int32_t tile_b) {
    anchor_a_ = tile_a;
    anchor_b_ = tile_b;
  }
  std::int32_t anchorA() const { return anchor_a_; }
  std::int32_t anchorB() const { return anchor_b_; }

  /// By key, ascending.
  const std::vector<RasterPatch>& patches() const { return patches_; }
  /// Of all patches.
  TileWindow window() const;
  std::vector<PlacedTile> tilesOf(const RasterPatch& patch) const;

  const RasterTile* find(std::int32_t tile_a, std::int32_t tile_b) const {
    return tiles_.find(packKey(tile_a, tile_b));
  }
  RasterTile* find(std::int32_t tile_a, std::int32_t tile_b) {
    return tiles_.find(packKey(tile_a, tile_b));
  }
  /// The tile, which is added if it is new; that may move the others.
  RasterTile& tileAt(std::int32_t tile_a, std::int32_t tile_b);
  bool at(std::int32_t a, std::int32_t b) const {
    const RasterTile* tile = find(a >> 3, b >> 3);
    return tile != nullptr && ((tile->occupied() >> (8 * (b & 7) + (a & 7))) & 1u) != 0;
  }
  /// Is a cell occupied whose index differs by at most radius in a and in b?
  bool anyWithin(std::int32_t a, std::int32_t b, std::int32_t radius) const;
  /// Calls visit(a, b, tile) for each tile of the patch that holds a cell, by b, then a.
  template <typename Visit>
  void forEachTile(const RasterPatch& patch, Visit&& visit) const {
    const TileWindow& w = patch.window;
    for (std::int32_t b = w.low_b; b <= w.high_b; ++b) {
      for (std::int32_t a = w.low_a; a <= w.high_a; ++a) {
        const RasterTile* tile = find(a, b);
        if (tile != nullptr && tile->occupied() != 0) visit(a, b, *tile);
      }
    }
  }
  template <typename Visit>
  void forEachTile(Visit&& visit) const {
    for (const RasterPatch& patch : patches_) forEachTile(patch, visit);
  }

  /// Says that cells of the tile changed.
  void markDirty(std::int32_t tile_a, std::int32_t tile_b) { patchAt(tile_a, tile_b).dirty = true; }
  void markAllDirty();
  /// Stamps the dirty patches with \p revision; forgets tiles and patches without a cell. \return
  /// how many patches were dirty
  std::size_t commit(std::uint32_t revision);
  std::size_t memoryBytes() const { return tiles_.memoryBytes() + capacityBytes(patches_); }

 private:
  RasterPatch& patchAt(std::int32_t tile_a, std::int32_t tile_b);

  std::int32_t anchor_a_ = 0;
  std::int32_t anchor_b_ = 0;
  std::vector<RasterPatch> patches_;
  KeyMap<RasterTile> tiles_;
};

}  // namespace planar_mapping::detail
