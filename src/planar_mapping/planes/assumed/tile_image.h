// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "planar_mapping/planes/assumed/assumed_points.h"

namespace planar_mapping::detail {

/// From a tile to those around it; opposite ones are four apart.
constexpr std::array<std::array<int, 2>, 8> kTileDirections = {
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

constexpr std::size_t kMinEnds = 8;  ///< tiles of a plane at the ends of a hole

/// kEvenTileSide pixels a side.
struct Tile {
  int measured = 0;                 ///< pixels
  Vector3 point = Vector3::Zero();  ///< the mean in an image of inverse depth
  int plane = -1;                   ///< that most of what is measured belongs to
};

/// Even tiles without a step between them that are not measured, and measured ones around them.
struct Hole {
  Indices tiles;
  Indices ends;  ///< ascending
};

/// A cloud in tiles, numbered row by row.
class TileImage {
 public:
  /// \param even  see evenTiles()
  TileImage(const PointsView& cloud, const PinholeCamera& camera,
            const std::vector<std::uint8_t>& even);

  int size() const { return static_cast<int>(tiles_.size()); }
  Tile& operator[](int tile) { return tiles_[static_cast<std::size_t>(tile)]; }
  const Tile& operator[](int tile) const { return tiles_[static_cast<std::size_t>(tile)]; }

  /// Gives tiles to the planes that hold most of their measured pixels.
  void label(const std::vector<PlaneSegment>& planes);
  Indices tilesOf(std::size_t plane) const;
  /// Those with kMinEnds ends or more; the one with most comes first.
  std::vector<Hole> findHoles() const;

  /// Even ones that are measured, next to holes: ascending.
  Indices besideHoles() const;

  /// Column and row.
  Vector2 middleOf(int tile) const {
    return {kEvenTileSide * (tile % columns_ + 0.5) - 0.5,
            kEvenTileSide * (tile / columns_ + 0.5) - 0.5};
  }
  /// Calls visit(column, row) for the pixels of a tile.
  template <typename Visit>
  void forEachPixel(int tile, const Visit& visit) const {
    const int top = kEvenTileSide * (tile / columns_);
    const int left = kEvenTileSide * (tile % columns_);
    for (int row = top; row < top + kEvenTileSide; ++row) {
      for (int column = left; column < left + kEvenTileSide; ++column) visit(column, row);
    }
  }

 private:
  bool isEven(int tile, std::size_t bit) const {
    return (even_[static_cast<std::size_t>(tile)] >> bit) % 2 == 1;
  }
  bool isHole(int tile) const { return (*this)[tile].measured == 0 && isEven(tile, 0); }
  /// The tile so many steps away in a direction; -1 outside.
  int beside(int tile, std::size_t direction, int steps = 1) const;
  Indices endsOf(const Indices& hole) const;

  int columns_;
  int rows_;
  std::uint32_t width_;  ///< of the cloud
  const std::vector<std::uint8_t>& even_;
  std::vector<Tile> tiles_;
};

}  // namespace planar_mapping::detail
