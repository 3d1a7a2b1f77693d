// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/store/tile_raster.h"

#include "planar_mapping/base/lists.h"

namespace planar_mapping::detail {
namespace {

static_assert(RasterPatch::kTiles == 16);

/// Bits of the columns [low, high] and rows [low, high] of a tile.
std::uint64_t tileRectangle(std::int32_t low_a, std::int32_t low_b, std::int32_t high_a,
                            std::int32_t high_b) {
  const std::uint64_t row = ((std::uint64_t{2} << high_a) - 1) & ~((std::uint64_t{1} << low_a) - 1);
  std::uint64_t bits = 0;
  for (std::int32_t b = low_b; b <= high_b; ++b) bits |= (row & 0xffu) << (8 * b);
  return bits;
}

}  // namespace

TileWindow TileRaster::window() const {
  TileWindow all;
  for (const RasterPatch& patch : patches_) {
    if (!patch.window.empty()) all.include(patch.window);
  }
  return all;
}

std::vector<PlacedTile> TileRaster::tilesOf(const RasterPatch& patch) const {
  std::vector<PlacedTile> placed;
  forEachTile(patch, [&](std::int32_t a, std::int32_t b, const RasterTile& tile) {
    placed.push_back({a, b, &tile});
  });
  return placed;
}

RasterPatch& TileRaster::patchAt(std::int32_t tile_a, std::int32_t tile_b) {
  const std::uint64_t key = packKey((tile_a - anchor_a_) >> 4, (tile_b - anchor_b_) >> 4);
  auto patch = std::lower_bound(patches_.begin(), patches_.end(), key,
                                [](const RasterPatch& p, std::uint64_t k) { return p.key < k; });
  if (patch == patches_.end() || patch->key != key) {
    patch = patches_.emplace(patch);
    patch->key = key;
  }
  return *patch;
}

RasterTile& TileRaster::tileAt(std::int32_t tile_a, std::int32_t tile_b) {
  patchAt(tile_a, tile_b).window.include(tile_a, tile_b);
  return tiles_[packKey(tile_a, tile_b)];
}

bool TileRaster::anyWithin(std::int32_t a, std::int32_t b, std::int32_t radius) const {
  for (const RasterPatch& patch : patches_) {
    const TileWindow& w = patch.window;
    const std::int32_t last_a = std::min((a + radius) >> 3, w.high_a);
    const std::int32_t last_b = std::min((b + radius) >> 3, w.high_b);
    for (std::int32_t tb = std::max((b - radius) >> 3, w.low_b); tb <= last_b; ++tb) {
      for (std::int32_t ta = std::max((a - radius) >> 3, w.low_a); ta <= last_a; ++ta) {
        const RasterTile* tile = find(ta, tb);
        if (tile == nullptr) continue;
        const std::uint64_t near =
            tileRectangle(std::max(a - radius - 8 * ta, 0), std::max(b - radius - 8 * tb, 0),
                          std::min(a + radius - 8 * ta, 7), std::min(b + radius - 8 * tb, 7));
        if ((tile->occupied() & near) != 0) return true;
      }
    }
  }
  return false;
}

void TileRaster::markAllDirty() {
  for (RasterPatch& patch : patches_) patch.dirty = true;
}

std::size_t TileRaster::commit(std::uint32_t revision) {
  std::size_t dirty = 0;
  for (RasterPatch& patch : patches_) {
    if (!patch.dirty) continue;
    TileWindow tight;
    forEachTile(patch,
                [&](std::int32_t a, std::int32_t b, const RasterTile&) { tight.include(a, b); });
    patch.window = tight;
    patch.revision = revision;
    patch.dirty = false;
    ++dirty;
  }
  if (dirty == 0) return 0;
  tiles_.removeIf([](std::uint64_t, const RasterTile& tile) { return tile.occupied() == 0; });
  eraseIf(patches_, [](const RasterPatch& patch) { return patch.window.empty(); });
  return dirty;
}

}  // namespace planar_mapping::detail
