// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "store/key_map.h"
#include "store/patch_tiles.h"

namespace planar_mapping::detail {

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

/// A block of kPatchCells x kPatchCells cells is a patch: the unit in which cuboids are made and
/// cells are packed, so that the cost of a frame does not grow with the plane. Patches start at the
/// middle of what was seen first, and what one frame sees of a plane rarely reaches beyond one.
constexpr std::int32_t kPatchCells = 8 * PatchTiles::kSide;

/// The occupied cells of a plane, opened to be looked at or changed: patches are unpacked when they
/// are asked for, so that even const functions are not to be called from several threads.
///
/// Cell (a, b) spans [a s, (a + 1) s) x [b s, (b + 1) s) along u and v of the plane's frame; tile
/// (a, b) has the cells 8 a to 8 a + 7 and 8 b to 8 b + 7.
class OpenRaster {
 public:
  OpenRaster() = default;
  /// What pack() wrote; the bytes must outlive this.
  explicit OpenRaster(PackReader in);

  /// The raster as it was packed, for another thread.
  OpenRaster reopened() const;

  /// First tile of patch (0, 0). Only where there is no tile yet.
  void setAnchor(std::int32_t tile_a, std::int32_t tile_b) {
    anchor_a_ = tile_a;
    anchor_b_ = tile_b;
  }
  std::int32_t anchorA() const { return anchor_a_; }
  std::int32_t anchorB() const { return anchor_b_; }

  // Patches, by key ascending.
  std::size_t patches() const { return patches_.size(); }
  std::uint64_t key(std::size_t patch) const { return patches_[patch].key; }
  /// Number of frames in the map when the patch changed last.
  std::uint32_t revision(std::size_t patch) const { return patches_[patch].revision; }
  /// Holds the tiles of the patch that have a cell; tight unless the patch was changed.
  const TileWindow& window(std::size_t patch) const { return patches_[patch].window; }
  /// Of all patches.
  TileWindow window() const;
  std::vector<PlacedTile> tilesOf(std::size_t patch) const;

  const RasterTile* find(std::int32_t tile_a, std::int32_t tile_b) const;
  RasterTile* find(std::int32_t tile_a, std::int32_t tile_b) {
    return const_cast<RasterTile*>(std::as_const(*this).find(tile_a, tile_b));
  }
  /// The tile, which is added if it is new; that may move the others of its patch.
  RasterTile& tileAt(std::int32_t tile_a, std::int32_t tile_b);
  bool at(std::int32_t a, std::int32_t b) const {
    const RasterTile* tile = find(a >> 3, b >> 3);
    return tile != nullptr && ((tile->occupied() >> (8 * (b & 7) + (a & 7))) & 1u) != 0;
  }
  /// Is a cell occupied whose index differs by at most radius in a and in b?
  bool anyWithin(std::int32_t a, std::int32_t b, std::int32_t radius) const;
  /// Calls visit(a, b, tile) for each tile of the patch that holds a cell.
  template <typename Visit>
  void forEachTile(std::size_t patch, Visit&& visit) const;
  template <typename Visit>
  void forEachTile(Visit&& visit) const {
    for (std::size_t p = 0; p < patches_.size(); ++p) forEachTile(p, visit);
  }

  /// Says that cells of the tile changed.
  void markDirty(std::int32_t tile_a, std::int32_t tile_b);
  void markAllDirty();
  std::size_t dirtyPatches() const;
  /// Writes the patches that hold a cell, with a new revision where they changed. \return whether
  /// there is one
  bool pack(std::uint32_t revision, PackWriter& out) const;

 private:
  struct Patch {
    std::uint64_t key = 0;
    std::uint32_t revision = 0;
    bool dirty = false;
    TileWindow window;
    const std::uint8_t* packed = nullptr;  ///< tiles as they were
    std::size_t packed_bytes = 0;
    std::unique_ptr<PatchTiles> tiles;  ///< once they were asked for
  };

  std::uint64_t keyOf(std::int32_t tile_a, std::int32_t tile_b) const {
    return packKey((tile_a - anchor_a_) >> 4, (tile_b - anchor_b_) >> 4);
  }
  int placeOf(std::int32_t tile_a, std::int32_t tile_b) const {
    return PatchTiles::kSide * ((tile_b - anchor_b_) & 15) + ((tile_a - anchor_a_) & 15);
  }
  std::vector<Patch>::iterator lowerBound(std::uint64_t key) const;
  Patch& patchAt(std::int32_t tile_a, std::int32_t tile_b);
  static PatchTiles& open(Patch& patch);
  TileWindow tightWindow(Patch& patch) const;

  std::int32_t anchor_a_ = 0;
  std::int32_t anchor_b_ = 0;
  mutable std::vector<Patch> patches_;
};

template <typename Visit>
void OpenRaster::forEachTile(std::size_t patch, Visit&& visit) const {
  const TileWindow& w = patches_[patch].window;
  PatchTiles& tiles = open(patches_[patch]);
  for (std::int32_t b = w.low_b; b <= w.high_b; ++b) {
    for (std::int32_t a = w.low_a; a <= w.high_a; ++a) {
      RasterTile* tile = tiles.find(placeOf(a, b));
      if (tile != nullptr && tile->occupied() != 0) visit(a, b, *tile);
    }
  }
}

}  // namespace planar_mapping::detail
