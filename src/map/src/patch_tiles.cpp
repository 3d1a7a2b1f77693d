// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "patch_tiles.h"

#include <algorithm>

#include "set_bits.h"

namespace planar_mapping::detail {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

// A tile: its place, a byte of the head, then what the head says there is: the cells, the least
// belief, and of each cell how far its belief is above that.
constexpr unsigned kBitsMask = 7u;        ///< bits of a belief, 0 = all are alike
constexpr unsigned kFull = 8u;            ///< all cells are occupied
constexpr unsigned kLeastAsBefore = 16u;  ///< as in the tile before

// The cells: two bits for each row, then a byte for each that is of its own.
enum Row : unsigned { kEmpty, kWhole, kAsBelow, kOwn };

void putCells(std::uint64_t cells, PackWriter& out) {
  unsigned codes = 0;
  const std::size_t head = out.bytes.size();
  out.byte(0);
  out.byte(0);
  std::uint64_t below = 0;
  for (unsigned b = 0; b < 8; ++b) {
    const std::uint64_t row = cells >> (8 * b) & 0xffu;
    const Row code = row == 0 ? kEmpty : row == 0xffu ? kWhole : row == below ? kAsBelow : kOwn;
    codes |= code << (2 * b);
    if (code == kOwn) out.byte(static_cast<unsigned>(row));
    below = row;
  }
  out.bytes[head] = static_cast<std::uint8_t>(codes);
  out.bytes[head + 1] = static_cast<std::uint8_t>(codes >> 8u);
}

std::uint64_t takeCells(PackReader& in) {
  unsigned codes = in.byte();
  codes |= static_cast<unsigned>(in.byte()) << 8u;
  std::uint64_t cells = 0;
  std::uint64_t row = 0;
  for (unsigned b = 0; b < 8; ++b, codes >>= 2u) {
    const auto code = static_cast<Row>(codes & 3u);
    if (code == kEmpty) row = 0;
    if (code == kWhole) row = 0xffu;
    if (code == kOwn) row = in.byte();
    cells |= row << (8 * b);
  }
  return cells;
}

}  // namespace

void PatchTiles::pack(PackWriter& out) const {
  unsigned before = 0;
  for (unsigned place = 0; place < kPlaces; ++place) {
    const std::int16_t at = position_[place];
    if (at == kNone) continue;
    const RasterTile& tile = tiles_[static_cast<std::size_t>(at)];
    const std::uint64_t cells = tile.occupied();
    if (cells == 0) continue;
    unsigned least = UINT8_MAX;
    unsigned most = 0;
    forEachBit(cells, [&](std::size_t bit) {
      const unsigned belief = tile.belief(bit);
      least = std::min(least, belief);
      most = std::max(most, belief);
    });
    unsigned bits = 0;
    while (((most - least) >> bits) != 0) ++bits;
    out.byte(place);
    out.byte(bits | (cells == kAll ? kFull : 0) | (least == before ? kLeastAsBefore : 0));
    if (cells != kAll) putCells(cells, out);
    if (least != before) out.byte(least);
    before = least;
    if (bits == 0) continue;
    unsigned rest = 0;
    unsigned held = 0;
    forEachBit(cells, [&](std::size_t bit) {
      rest |= (tile.belief(bit) - least) << held;
      held += bits;
      if (held < 8) return;
      out.byte(rest & 0xffu);
      rest >>= 8u;
      held -= 8;
    });
    if (held > 0) out.byte(rest);
  }
}

void PatchTiles::unpack(PackReader in, const std::uint8_t* end) {
  unsigned least = 0;
  while (in.at() != end) {
    RasterTile& tile = at(in.byte());
    const unsigned head = in.byte();
    const std::uint64_t cells = (head & kFull) != 0 ? kAll : takeCells(in);
    if ((head & kLeastAsBefore) == 0) least = in.byte();
    const unsigned bits = head & kBitsMask;
    const unsigned mask = (1u << bits) - 1;
    unsigned rest = 0;
    unsigned held = 0;
    forEachBit(cells, [&](std::size_t bit) {
      if (held < bits) {
        rest |= static_cast<unsigned>(in.byte()) << held;
        held += 8;
      }
      tile.setBelief(bit, static_cast<std::uint8_t>(least + (rest & mask)));
      rest >>= bits;
      held -= bits;
    });
  }
}

}  // namespace planar_mapping::detail
