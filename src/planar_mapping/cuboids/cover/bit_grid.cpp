// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/cuboids/cover/bit_grid.h"

#include <algorithm>

#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

/// Bits of a mask that are on in \p rows words, \p step apart.
PLANAR_MAPPING_MULTIVERSION
std::int64_t bitsOn(const std::uint64_t* words, std::size_t step, std::int32_t rows,
                    std::uint64_t mask) {
  std::int64_t sum = 0;
  for (std::int32_t i = 0; i < rows; ++i) sum += __builtin_popcountll(words[i * step] & mask);
  return sum;
}

}  // namespace

bool BitGrid::contains(const LatticeBox& box) const {
  for (std::size_t k = 0; k < 3; ++k) {
    if (box.low[k] < 0 || box.high[k] > size_[k]) return false;
  }
  return true;
}

LatticeBox BitGrid::clipped(const LatticeBox& box) const {
  LatticeBox b = box;
  for (std::size_t k = 0; k < 3; ++k) {
    b.low[k] = std::clamp(b.low[k], 0, size_[k]);
    b.high[k] = std::clamp(b.high[k], b.low[k], size_[k]);
  }
  // Nothing to visit: the loops over words need at least one cell.
  if (b.low[0] == b.high[0]) b.high[2] = b.low[2];
  return b;
}

bool BitGrid::all(const LatticeBox& box) const {
  if (!contains(box)) return false;
  for (std::int32_t w = box.low[0] >> 6; w <= (box.high[0] - 1) >> 6; ++w) {
    const std::uint64_t mask = maskOf(box, w);
    for (std::int32_t z = box.low[2]; z < box.high[2]; ++z) {
      const std::uint64_t* word = row(box.low[1], z) + w;
      for (std::int32_t y = box.low[1]; y < box.high[1]; ++y, word += words_) {
        if ((~*word & mask) != 0) return false;
      }
    }
  }
  return true;
}

/// Layers on beside a face of the box along y or z.
std::int32_t BitGrid::layersOn(const LatticeBox& box, std::size_t axis, bool up) const {
  const std::size_t other = 3 - axis;
  const std::size_t steps[3] = {1, words_, words_ * static_cast<std::size_t>(size_[1])};
  std::int32_t layers = up ? size_[axis] - box.high[axis] : box.low[axis];
  const auto beside = static_cast<std::size_t>(up ? box.high[axis] : box.low[axis] - 1);
  for (std::int32_t w = box.low[0] >> 6; layers > 0 && w <= (box.high[0] - 1) >> 6; ++w) {
    const std::uint64_t mask = maskOf(box, w);
    const std::uint64_t* layer = bits_.data() + w + beside * steps[axis] +
                                 static_cast<std::size_t>(box.low[other]) * steps[other];
    std::int32_t on = 0;
    for (bool all_on = true; on < layers; ++on) {
      const std::uint64_t* word = layer;
      for (std::int32_t i = box.low[other]; all_on && i < box.high[other]; ++i) {
        all_on = (~*word & mask) == 0;
        word += steps[other];
      }
      if (!all_on) break;
      if (on + 1 < layers) layer = up ? layer + steps[axis] : layer - steps[axis];
    }
    layers = on;
  }
  return layers;
}

/// Bits of word \p w that are on in all rows of the box; 0 at once where none of those \p asked is.
std::uint64_t BitGrid::commonBits(const LatticeBox& box, std::int32_t w,
                                  std::uint64_t asked) const {
  std::uint64_t on = ~std::uint64_t{0};
  for (std::int32_t z = box.low[2]; z < box.high[2]; ++z) {
    const std::uint64_t* word = row(box.low[1], z) + w;
    for (std::int32_t y = box.low[1]; y < box.high[1]; ++y, word += words_) {
      on &= *word;
      if ((on & asked) == 0) return 0;
    }
  }
  return on;
}

/// Bits of word \p w that are on in any of the rows.
std::uint64_t BitGrid::anyBits(const LatticeBox& rows, std::size_t w) const {
  std::uint64_t on = 0;
  for (std::int32_t z = rows.low[2]; z < std::min(rows.high[2], size_[2]); ++z) {
    for (std::int32_t y = rows.low[1]; y < std::min(rows.high[1], size_[1]); ++y)
      on |= row(y, z)[w];
  }
  return on;
}

LatticeBox BitGrid::hull() const {
  LatticeBox box{size_, {0, 0, 0}};
  for (std::int32_t z = 0; z < size_[2]; ++z) {
    for (std::int32_t y = 0; y < size_[1]; ++y) {
      const std::uint64_t* words = row(y, z);
      for (std::size_t w = 0; w < words_; ++w) {
        if (words[w] == 0) continue;
        const auto first = static_cast<std::int32_t>(64 * w);
        box.low[0] = std::min(box.low[0], first + __builtin_ctzll(words[w]));
        box.high[0] = std::max(box.high[0], first + 64 - __builtin_clzll(words[w]));
        box.low[1] = std::min(box.low[1], y);
        box.high[1] = std::max(box.high[1], y + 1);
        box.low[2] = std::min(box.low[2], z);
        box.high[2] = z + 1;
      }
    }
  }
  return box.high[2] == 0 ? LatticeBox() : box;
}

BitGrid BitGrid::cropped(const LatticeBox& box) const {
  BitGrid grid(box.size(0), box.size(1), box.size(2));
  const auto skipped = static_cast<std::size_t>(box.low[0] >> 6);
  const int shift = box.low[0] & 63;
  for (std::int32_t z = 0; z < grid.size_[2]; ++z) {
    for (std::int32_t y = 0; y < grid.size_[1]; ++y) {
      const std::uint64_t* from = row(box.low[1] + y, box.low[2] + z) + skipped;
      std::uint64_t* to = grid.row(y, z);
      for (std::size_t w = 0; w < grid.words_; ++w) {
        to[w] = from[w] >> shift;
        if (shift > 0 && skipped + w + 1 < words_) to[w] |= from[w + 1] << (64 - shift);
      }
      if (grid.words_ > 0)
        to[grid.words_ - 1] &= maskOf(grid.window(), static_cast<std::int32_t>(grid.words_) - 1);
    }
  }
  return grid;
}

void BitGrid::extendUp(LatticeBox& box, std::size_t axis) const {
  if (axis != 0) {
    box.high[axis] += layersOn(box, axis, true);
    return;
  }
  while (box.high[0] < size_[0]) {
    const std::int32_t bit = box.high[0] & 63;
    const std::uint64_t off = ~commonBits(box, box.high[0] >> 6, std::uint64_t{1} << bit) >> bit;
    const std::int32_t run = off == 0 ? 64 - bit : __builtin_ctzll(off);
    box.high[0] += run;
    if (run < 64 - bit) return;
  }
}

void BitGrid::extendDown(LatticeBox& box, std::size_t axis) const {
  if (axis != 0) {
    box.low[axis] -= layersOn(box, axis, false);
    return;
  }
  while (box.low[0] > 0) {
    const std::int32_t bit = (box.low[0] - 1) & 63;
    const std::uint64_t off = ~commonBits(box, (box.low[0] - 1) >> 6, std::uint64_t{1} << bit)
                              << (63 - bit);
    const std::int32_t run = off == 0 ? bit + 1 : __builtin_clzll(off);
    box.low[0] -= run;
    if (run <= bit) return;
  }
}

std::int64_t BitGrid::count(const LatticeBox& box) const {
  const LatticeBox b = clipped(box);
  std::int64_t sum = 0;
  for (std::int32_t z = b.low[2]; z < b.high[2]; ++z) {
    for (std::int32_t w = b.low[0] >> 6; w <= (b.high[0] - 1) >> 6; ++w) {
      sum += bitsOn(row(b.low[1], z) + w, words_, b.size(1), maskOf(b, w));
    }
  }
  return sum;
}

void BitGrid::clear(const LatticeBox& box) {
  const LatticeBox b = clipped(box);
  for (std::int32_t z = b.low[2]; z < b.high[2]; ++z) {
    for (std::int32_t y = b.low[1]; y < b.high[1]; ++y) {
      std::uint64_t* words = row(y, z);
      for (std::int32_t w = b.low[0] >> 6; w <= (b.high[0] - 1) >> 6; ++w) {
        words[w] &= ~maskOf(b, w);
      }
    }
  }
}

void BitGrid::fill(const LatticeBox& box) {
  for (std::int32_t w = box.low[0] >> 6; w <= (box.high[0] - 1) >> 6; ++w) {
    const std::uint64_t mask = maskOf(box, w);
    for (std::int32_t z = box.low[2]; z < box.high[2]; ++z) {
      std::uint64_t* word = row(box.low[1], z) + w;
      for (std::int32_t y = box.low[1]; y < box.high[1]; ++y, word += words_) *word |= mask;
    }
  }
}

BitGrid BitGrid::dilated(std::array<std::int32_t, 3> axes) const {
  BitGrid grid = *this;
  if (axes[0] > 0) {
    const std::size_t rows = bits_.size() / words_;
    for (std::size_t r = 0; r < rows; ++r) {
      const std::uint64_t* in = &bits_[r * words_];
      std::uint64_t* out = &grid.bits_[r * words_];
      for (std::size_t w = 0; w < words_; ++w) {
        out[w] |= in[w] << 1 | in[w] >> 1;
        if (w > 0) out[w] |= in[w - 1] >> 63;
        if (w + 1 < words_) out[w] |= in[w + 1] << 63;
      }
      if ((size_[0] & 63) != 0) out[words_ - 1] &= (std::uint64_t{1} << (size_[0] & 63)) - 1;
    }
  }
  const auto spread = [&](std::size_t step, std::size_t period) {
    const std::vector<std::uint64_t> before = grid.bits_;
    for (std::size_t first = 0; first < before.size(); first += period) {
      for (std::size_t i = first + step; i < first + period; ++i) {
        grid.bits_[i] |= before[i - step];
        grid.bits_[i - step] |= before[i];
      }
    }
  };
  const std::size_t layer = words_ * static_cast<std::size_t>(size_[1]);
  if (axes[1] > 0 && layer > 0) spread(words_, layer);
  if (axes[2] > 0 && layer > 0) spread(layer, bits_.size());
  return grid;
}

}  // namespace planar_mapping::detail
