// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "store/packed_numbers.h"

namespace planar_mapping::detail {

/// 8 x 8 cells of a plane's raster, to be worked on.
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
  /// Of an occupied cell.
  void remove(std::size_t bit) { occupied_ &= ~(std::uint64_t{1} << bit); }

 private:
  std::uint64_t occupied_ = 0;
  std::array<std::uint8_t, 64> beliefs_{};
};

/// The tiles of a patch, of which there are kSide x kSide at most, to be worked on.
class PatchTiles {
 public:
  static constexpr int kSide = 16;
  static constexpr int kPlaces = kSide * kSide;  ///< kSide b + a

  PatchTiles() { position_.fill(kNone); }

  RasterTile* find(int place) {
    const std::int16_t at = position_[static_cast<std::size_t>(place)];
    return at == kNone ? nullptr : &tiles_[static_cast<std::size_t>(at)];
  }
  /// The tile, which is added if it is new; that may move the others.
  RasterTile& at(int place) {
    std::int16_t& at = position_[static_cast<std::size_t>(place)];
    if (at == kNone) {
      at = static_cast<std::int16_t>(tiles_.size());
      tiles_.emplace_back();
    }
    return tiles_[static_cast<std::size_t>(at)];
  }

  /// Writes the tiles that hold a cell, one after the other: a full tile of one belief takes two to
  /// three bytes, any tile at most 53.
  void pack(PackWriter& bytes) const;
  /// Adds what pack() wrote, up to \p end.
  void unpack(PackReader bytes, const std::uint8_t* end);

 private:
  static constexpr std::int16_t kNone = -1;

  std::array<std::int16_t, kPlaces> position_;
  std::vector<RasterTile> tiles_;  ///< in the order in which they came
};

}  // namespace planar_mapping::detail
