// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/assumed/tile_image.h"

#include <algorithm>

#include "planar_mapping/base/lists.h"

namespace planar_mapping::detail {
namespace {

constexpr int kMinMeasured = kEvenTileSide * kEvenTileSide / 2;  // pixels of a tile at an end
constexpr int kRim = 3;  // tiles between a hole and what is measured beside it

}  // namespace

TileImage::TileImage(const PointsView& cloud, const PinholeCamera& camera,
                     const std::vector<std::uint8_t>& even)
    : columns_(static_cast<int>(cloud.width) / kEvenTileSide),
      rows_(static_cast<int>(cloud.height) / kEvenTileSide),
      width_(cloud.width),
      even_(even),
      tiles_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {
  for (int i = 0; i < size(); ++i) {
    Vector3 sum = Vector3::Zero();  // of column, row and inverse depth
    int count = 0;
    forEachPixel(i, [&](int column, int row) {
      const std::size_t k =
          static_cast<std::size_t>(row) * width_ + static_cast<std::size_t>(column);
      if (!cloud.isMeasured(k)) return;
      sum += Vector3(column, row, 1.0 / double{cloud[k][2]});
      ++count;
    });
    Tile& tile = (*this)[i];
    tile.measured = count;
    if (count > 0) tile.point = camera.rayOf(sum[0] / count, sum[1] / count) * count / sum[2];
  }
}

void TileImage::label(const std::vector<PlaneSegment>& planes) {
  std::vector<int> votes(tiles_.size());
  for (std::size_t k = 0; k < planes.size(); ++k) {
    std::fill(votes.begin(), votes.end(), 0);
    for (const int i : planes[k].inliers) {
      const int column = i % static_cast<int>(width_) / kEvenTileSide;
      const int row = i / static_cast<int>(width_) / kEvenTileSide;
      if (column >= columns_ || row >= rows_) continue;
      const int own = row * columns_ + column;
      if (2 * ++votes[static_cast<std::size_t>(own)] > (*this)[own].measured)
        (*this)[own].plane = static_cast<int>(k);
    }
  }
}

Indices TileImage::tilesOf(std::size_t plane) const {
  Indices tiles;
  for (int i = 0; i < size(); ++i) {
    if ((*this)[i].plane == static_cast<int>(plane)) tiles.push_back(i);
  }
  return tiles;
}

int TileImage::beside(int tile, std::size_t direction, int steps) const {
  const int x = tile % columns_ + steps * kTileDirections[direction][0];
  const int y = tile / columns_ + steps * kTileDirections[direction][1];
  return x >= 0 && y >= 0 && x < columns_ && y < rows_ ? y * columns_ + x : -1;
}

std::vector<Hole> TileImage::findHoles() const {
  std::vector<Hole> holes;
  std::vector<char> is_visited(tiles_.size(), 0);
  const auto isNew = [&](int tile) {
    return isHole(tile) && is_visited[static_cast<std::size_t>(tile)] == 0;
  };
  for (int seed = 0; seed < size(); ++seed) {
    if (!isNew(seed)) continue;
    Hole hole;
    const auto take = [&](int tile) {
      is_visited[static_cast<std::size_t>(tile)] = 1;
      hole.tiles.push_back(tile);
    };
    take(seed);
    for (std::size_t k = 0; k < hole.tiles.size(); ++k) {
      const int own = hole.tiles[k];
      for (std::size_t direction = 0; direction < 8; direction += 2) {
        const int next = beside(own, direction);
        if (next < 0 || !isNew(next)) continue;
        const bool is_step =
            direction < 4 ? isEven(own, 1 + direction) : isEven(next, direction - 3);
        if (!is_step) take(next);
      }
    }
    hole.ends = endsOf(hole.tiles);
    if (hole.ends.size() >= kMinEnds) holes.push_back(std::move(hole));
  }
  // What is seen best comes first: its planes are known to the others.
  std::stable_sort(holes.begin(), holes.end(),
                   [](const Hole& a, const Hole& b) { return a.ends.size() > b.ends.size(); });
  return holes;
}

Indices TileImage::besideHoles() const {
  Indices tiles;
  for (int own = 0; own < size(); ++own) {
    if ((*this)[own].measured == 0 || !isEven(own, 0)) continue;
    bool is_beside = false;
    for (std::size_t direction = 0; direction < 8 && !is_beside; ++direction) {
      const int next = beside(own, direction);
      is_beside = next >= 0 && isHole(next);
    }
    if (is_beside) tiles.push_back(own);
  }
  return tiles;
}

Indices TileImage::endsOf(const Indices& hole) const {
  Indices ends;
  for (const int own : hole) {
    for (std::size_t direction = 0; direction < 8; ++direction) {
      for (int steps = 1; steps <= kRim + 1; ++steps) {
        const int next = beside(own, direction, steps);
        if (next < 0 || isHole(next)) break;
        if ((*this)[next].measured < kMinMeasured) continue;
        ends.push_back(next);
        break;
      }
    }
  }
  makeDistinct(ends);
  return ends;
}

}  // namespace planar_mapping::detail
