// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/patch_tiles.h"

#include <algorithm>

#include "store/set_bits.h"

namespace planar_mapping::detail {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

// A tile, in bits: its place, a head, then what the head says there is: the cells, the least
// belief, and of each cell how far its belief is above that.
constexpr unsigned kPlaceBits = 8;
constexpr unsigned kHeadBits = 5;
constexpr unsigned kBitsMask = 7u;        ///< bits of a belief, 0 = all are alike
constexpr unsigned kFull = 8u;            ///< all cells are occupied
constexpr unsigned kLeastAsBefore = 16u;  ///< as in the tile before
constexpr unsigned kLeast = 4;            ///< how large it mostly is (BitWriter)

// The cells: two bits for each row, then a byte for each that is of its own.
enum Row : unsigned { kEmpty, kWhole, kAsBelow, kOwn };

void putCells(std::uint64_t cells, BitWriter& out) {
  unsigned codes = 0;
  std::uint64_t below = 0;
  const auto forEachRow = [&](auto&& visit) {
    for (unsigned b = 0; b < 8; ++b) visit(b, cells >> (8 * b) & 0xffu);
  };
  forEachRow([&](unsigned b, std::uint64_t row) {
    const Row code = row == 0 ? kEmpty : row == 0xffu ? kWhole : row == below ? kAsBelow : kOwn;
    codes |= code << (2 * b);
    below = row;
  });
  out.bits(codes, 16);
  forEachRow([&](unsigned b, std::uint64_t row) {
    if ((codes >> (2 * b) & 3u) == kOwn) out.bits(row, 8);
  });
}

std::uint64_t takeCells(BitReader& in) {
  auto codes = static_cast<unsigned>(in.bits(16));
  std::uint64_t cells = 0;
  std::uint64_t row = 0;
  for (unsigned b = 0; b < 8; ++b, codes >>= 2u) {
    const auto code = static_cast<Row>(codes & 3u);
    if (code == kEmpty) row = 0;
    if (code == kWhole) row = 0xffu;
    if (code == kOwn) row = in.bits(8);
    cells |= row << (8 * b);
  }
  return cells;
}

}  // namespace

void PatchTiles::pack(PackWriter& bytes) const {
  BitWriter out(bytes);
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
    out.bits(place, kPlaceBits);
    out.bits(bits | (cells == kAll ? kFull : 0) | (least == before ? kLeastAsBefore : 0),
             kHeadBits);
    if (cells != kAll) putCells(cells, out);
    if (least != before) out.number(least, kLeast);
    before = least;
    forEachBit(cells, [&](std::size_t bit) { out.bits(tile.belief(bit) - least, bits); });
  }
}

void PatchTiles::unpack(PackReader bytes, const std::uint8_t* end) {
  BitReader in(bytes);
  unsigned least = 0;
  // What is left of the last byte is less than a tile needs.
  while (bytes.at() != end) {
    RasterTile& tile = at(static_cast<int>(in.bits(kPlaceBits)));
    const auto head = static_cast<unsigned>(in.bits(kHeadBits));
    const std::uint64_t cells = (head & kFull) != 0 ? kAll : takeCells(in);
    if ((head & kLeastAsBefore) == 0) least = in.as<unsigned>(kLeast);
    const unsigned bits = head & kBitsMask;
    forEachBit(cells, [&](std::size_t bit) {
      tile.setBelief(bit, static_cast<std::uint8_t>(least + in.bits(bits)));
    });
  }
}

}  // namespace planar_mapping::detail
