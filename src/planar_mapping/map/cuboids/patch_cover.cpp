// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/cuboids/patch_cover.h"

#include <algorithm>
#include <utility>

#include "planar_mapping/map/store/belief.h"

namespace planar_mapping::detail {
namespace {

/// The tiles of a patch as they are to be approximated: together, or where almost all of their
/// window is empty, each group of tiles that touch on its own. Empty cells cost time too, so that
/// this bounds the time by the number of tiles.
std::vector<std::vector<PlacedTile>> islandsOf(const std::vector<PlacedTile>& tiles) {
  constexpr std::size_t kSparse = 16;  // tiles of the window for each that holds a cell
  if (tiles.empty()) return {};
  TileWindow w;
  for (const PlacedTile& t : tiles) w.include(t.a, t.b);
  const std::int32_t width = w.high_a - w.low_a + 1;
  const std::int32_t height = w.high_b - w.low_b + 1;
  if (static_cast<std::size_t>(width) * height <= kSparse * tiles.size()) return {tiles};

  std::vector<const RasterTile*> at(static_cast<std::size_t>(width) * height, nullptr);
  const auto place = [&](std::int32_t a, std::int32_t b) -> const RasterTile*& {
    return at[static_cast<std::size_t>(b - w.low_b) * width +
              static_cast<std::size_t>(a - w.low_a)];
  };
  for (const PlacedTile& t : tiles) place(t.a, t.b) = t.tile;
  std::vector<std::vector<PlacedTile>> islands;
  for (std::int32_t b = w.low_b; b <= w.high_b; ++b) {
    for (std::int32_t a = w.low_a; a <= w.high_a; ++a) {
      if (place(a, b) == nullptr) continue;
      std::vector<PlacedTile> island{{a, b, std::exchange(place(a, b), nullptr)}};
      for (std::size_t i = 0; i < island.size(); ++i) {
        const PlacedTile from = island[i];
        const std::int32_t last_a = std::min(from.a + 1, w.high_a);
        const std::int32_t last_b = std::min(from.b + 1, w.high_b);
        for (std::int32_t nb = std::max(from.b - 1, w.low_b); nb <= last_b; ++nb) {
          for (std::int32_t na = std::max(from.a - 1, w.low_a); na <= last_a; ++na) {
            if (place(na, nb) == nullptr) continue;
            island.push_back({na, nb, std::exchange(place(na, nb), nullptr)});
          }
        }
      }
      islands.push_back(std::move(island));
    }
  }
  return islands;
}

/// Rectangles of tiles of a plane.
SurfaceCover coverTiles(const std::vector<PlacedTile>& members,
                        const CuboidApproximationParams& params) {
  // The window is tight to the cells: the paper's first unit is the bounding rectangle.
  TileWindow w;
  for (const PlacedTile& t : members) {
    forEachBit(t.tile->occupied(), [&](std::size_t bit) {
      w.include(8 * t.a + static_cast<std::int32_t>(bit & 7u),
                8 * t.b + static_cast<std::int32_t>(bit >> 3u));
    });
  }
  CellMask mask{w.low_a, w.low_b, w.high_a - w.low_a + 1, w.high_b - w.low_b + 1, {}};
  mask.cells.assign(static_cast<std::size_t>(mask.width) * mask.height, 0);
  std::vector<float> probability(mask.cells.size(), 1.0f);
  for (const PlacedTile& t : members) {
    forEachBit(t.tile->occupied(), [&](std::size_t bit) {
      const std::size_t cell =
          (8 * t.b + (bit >> 3u) - w.low_b) * mask.width + 8 * t.a + (bit & 7u) - w.low_a;
      mask.cells[cell] = 1;
      probability[cell] = beliefOf(t.tile->belief(bit));
    });
  }
  return coverSurface(mask, probability, params);
}

}  // namespace

std::size_t PatchCover::count() const {
  return static_cast<std::size_t>(std::count_if(rectangles.begin(), rectangles.end(),
                                                [](const Rectangle& r) { return !r.replaced; }));
}

std::size_t PatchCover::memoryBytes() const {
  return capacityBytes(rectangles) + capacityBytes(loose) + capacityBytes(regions);
}

SurfaceCover coverPatch(const std::vector<PlacedTile>& tiles,
                        const CuboidApproximationParams& params) {
  SurfaceCover all;
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  for (const std::vector<PlacedTile>& part : islandsOf(tiles)) {
    const SurfaceCover some = coverTiles(part, params);
    append(all.rectangles, some.rectangles);
    append(all.probability, some.probability);
    append(all.loose, some.loose);
  }
  return all;
}

std::vector<SurfacePiece> piecesOf(const HalfCellRectangle& r, const TileRaster& raster,
                                   const PlaneFrame& plane, const SurfaceBand& band,
                                   const CuboidApproximationParams& params) {
  std::vector<SurfacePiece> pieces;
  std::vector<PlaneFrame> frames(1, plane);
  if (band.front > 0.0) {
    frames.push_back(plane);
    frames[0].origin += band.front * plane.n;
    frames[1].origin -= std::min(band.front, band.back) * plane.n;
  }
  const std::int32_t reach = params.absorption >= 0.5 ? 1 : 0;
  for (std::int32_t b = r.b - reach; b < r.b + r.height + reach; ++b) {
    for (std::int32_t a = r.a - reach; a < r.a + r.width + reach; ++a) {
      const RasterTile* tile = raster.find(a >> 4, b >> 4);
      const int bit = 8 * (b >> 1 & 7) + (a >> 1 & 7);
      if (tile == nullptr || (tile->occupied() >> bit & 1u) == 0) continue;
      const float belief = beliefOf(tile->belief(static_cast<std::size_t>(bit)));
      for (const PlaneFrame& frame : frames) addPieces({a, b, belief}, frame, params, pieces);
    }
  }
  return pieces;
}

}  // namespace planar_mapping::detail
