// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/open_raster.h"

namespace planar_mapping::detail {
namespace {

static_assert(PatchTiles::kSide == 16);

// How large the numbers of a raster mostly are, as powers of two (BitWriter).
constexpr unsigned kAnchor = 1;
constexpr unsigned kFew = 0;  // patches, and how far they reach
constexpr unsigned kRevision = 3;
constexpr unsigned kTileBytes = 4;

/// Bits of the columns [low, high] and rows [low, high] of a tile.
std::uint64_t tileRectangle(std::int32_t low_a, std::int32_t low_b, std::int32_t high_a,
                            std::int32_t high_b) {
  const std::uint64_t row = ((std::uint64_t{2} << high_a) - 1) & ~((std::uint64_t{1} << low_a) - 1);
  std::uint64_t bits = 0;
  for (std::int32_t b = low_b; b <= high_b; ++b) bits |= (row & 0xffu) << (8 * b);
  return bits;
}

}  // namespace

OpenRaster::OpenRaster(PackReader in) {
  BitReader bits(in);
  anchor_a_ = bits.differenceAs<std::int32_t>(kAnchor);
  anchor_b_ = bits.differenceAs<std::int32_t>(kAnchor);
  patches_.resize(bits.as<std::size_t>(kFew));
  for (Patch& patch : patches_) {
    const auto pa = bits.differenceAs<std::int32_t>(kFew);
    const auto pb = bits.differenceAs<std::int32_t>(kFew);
    patch.key = packKey(pa, pb);
    patch.revision = bits.as<std::uint32_t>(kRevision);
    TileWindow& window = patch.window;
    window.low_a = anchor_a_ + PatchTiles::kSide * pa + static_cast<std::int32_t>(bits.bits(4));
    window.low_b = anchor_b_ + PatchTiles::kSide * pb + static_cast<std::int32_t>(bits.bits(4));
    window.high_a = window.low_a + bits.as<std::int32_t>(kFew);
    window.high_b = window.low_b + bits.as<std::int32_t>(kFew);
    patch.packed_bytes = bits.as<std::size_t>(kTileBytes);
  }
  for (Patch& patch : patches_) {
    patch.packed = in.at();
    in.skip(patch.packed_bytes);
  }
}

OpenRaster OpenRaster::reopened() const {
  OpenRaster raster;
  raster.setAnchor(anchor_a_, anchor_b_);
  raster.patches_.reserve(patches_.size());
  for (const Patch& p : patches_) {
    raster.patches_.push_back(
        {p.key, p.revision, false, p.window, p.packed, p.packed_bytes, nullptr});
  }
  return raster;
}

bool OpenRaster::pack(std::uint32_t revision, PackWriter& out) const {
  std::vector<std::pair<Patch*, TileWindow>> kept;
  for (Patch& patch : patches_) {
    const bool changed = patch.dirty && patch.tiles != nullptr;
    const TileWindow window = changed ? tightWindow(patch) : patch.window;
    if (!window.empty()) kept.emplace_back(&patch, window);
  }
  BitWriter bits(out);
  bits.difference(anchor_a_, kAnchor);
  bits.difference(anchor_b_, kAnchor);
  bits.number(kept.size(), kFew);
  PackWriter tiles;  // of all patches
  for (const auto& [patch, window] : kept) {
    const std::size_t before = tiles.bytes.size();
    if (patch->dirty && patch->tiles != nullptr) {
      patch->tiles->pack(tiles);
    } else {
      tiles.append(patch->packed, patch->packed_bytes);
    }
    std::int32_t pa = 0, pb = 0;
    unpackKey(patch->key, pa, pb);
    bits.difference(pa, kFew);
    bits.difference(pb, kFew);
    bits.number(patch->dirty ? revision : patch->revision, kRevision);
    const auto within = [](std::int32_t tile, std::int32_t anchor) {
      return static_cast<std::uint64_t>((tile - anchor) & (PatchTiles::kSide - 1));
    };
    bits.bits(within(window.low_a, anchor_a_), 4);
    bits.bits(within(window.low_b, anchor_b_), 4);
    bits.number(static_cast<std::uint64_t>(window.high_a - window.low_a), kFew);
    bits.number(static_cast<std::uint64_t>(window.high_b - window.low_b), kFew);
    bits.number(tiles.bytes.size() - before, kTileBytes);
  }
  out.append(tiles.bytes.data(), tiles.bytes.size());
  return !kept.empty();
}

TileWindow OpenRaster::window() const {
  TileWindow all;
  for (const Patch& patch : patches_) {
    if (!patch.window.empty()) all.include(patch.window);
  }
  return all;
}

TileWindow OpenRaster::tightWindow(Patch& patch) const {
  TileWindow tight;
  const TileWindow& w = patch.window;
  for (std::int32_t b = w.low_b; b <= w.high_b; ++b) {
    for (std::int32_t a = w.low_a; a <= w.high_a; ++a) {
      const RasterTile* tile = patch.tiles->find(placeOf(a, b));
      if (tile != nullptr && tile->occupied() != 0) tight.include(a, b);
    }
  }
  return tight;
}

std::vector<PlacedTile> OpenRaster::tilesOf(std::size_t patch) const {
  std::vector<PlacedTile> placed;
  forEachTile(patch, [&](std::int32_t a, std::int32_t b, const RasterTile& tile) {
    placed.push_back({a, b, &tile});
  });
  return placed;
}

std::vector<OpenRaster::Patch>::iterator OpenRaster::lowerBound(std::uint64_t key) const {
  return std::lower_bound(patches_.begin(), patches_.end(), key,
                          [](const Patch& p, std::uint64_t k) { return p.key < k; });
}

PatchTiles& OpenRaster::open(Patch& patch) {
  if (patch.tiles == nullptr) {
    patch.tiles = std::make_unique<PatchTiles>();
    patch.tiles->unpack(PackReader(patch.packed), patch.packed + patch.packed_bytes);
  }
  return *patch.tiles;
}

const RasterTile* OpenRaster::find(std::int32_t tile_a, std::int32_t tile_b) const {
  const std::uint64_t key = keyOf(tile_a, tile_b);
  const auto patch = lowerBound(key);
  if (patch == patches_.end() || patch->key != key) return nullptr;
  return open(*patch).find(placeOf(tile_a, tile_b));
}

OpenRaster::Patch& OpenRaster::patchAt(std::int32_t tile_a, std::int32_t tile_b) {
  const std::uint64_t key = keyOf(tile_a, tile_b);
  auto patch = lowerBound(key);
  if (patch == patches_.end() || patch->key != key) {
    patch = patches_.emplace(patch);
    patch->key = key;
  }
  return *patch;
}

RasterTile& OpenRaster::tileAt(std::int32_t tile_a, std::int32_t tile_b) {
  Patch& patch = patchAt(tile_a, tile_b);
  patch.window.include(tile_a, tile_b);
  return open(patch).at(placeOf(tile_a, tile_b));
}

bool OpenRaster::anyWithin(std::int32_t a, std::int32_t b, std::int32_t radius) const {
  for (Patch& patch : patches_) {
    const TileWindow& w = patch.window;
    const std::int32_t last_a = std::min((a + radius) >> 3, w.high_a);
    const std::int32_t last_b = std::min((b + radius) >> 3, w.high_b);
    for (std::int32_t tb = std::max((b - radius) >> 3, w.low_b); tb <= last_b; ++tb) {
      for (std::int32_t ta = std::max((a - radius) >> 3, w.low_a); ta <= last_a; ++ta) {
        const RasterTile* tile = open(patch).find(placeOf(ta, tb));
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

void OpenRaster::markDirty(std::int32_t tile_a, std::int32_t tile_b) {
  patchAt(tile_a, tile_b).dirty = true;
}

void OpenRaster::markAllDirty() {
  for (Patch& patch : patches_) patch.dirty = true;
}

std::size_t OpenRaster::dirtyPatches() const {
  return static_cast<std::size_t>(std::count_if(patches_.begin(), patches_.end(),
                                                [](const Patch& patch) { return patch.dirty; }));
}

}  // namespace planar_mapping::detail
