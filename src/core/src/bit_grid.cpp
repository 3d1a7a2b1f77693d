// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "bit_grid.h"

#include <algorithm>

namespace planar_mapping::detail {

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
  for (std::int32_t z = box.low[2]; z < box.high[2]; ++z) {
    for (std::int32_t y = box.low[1]; y < box.high[1]; ++y) {
      const std::uint64_t* words = row(y, z);
      for (std::int32_t w = box.low[0] >> 6; w <= (box.high[0] - 1) >> 6; ++w) {
        if ((~words[w] & maskOf(box, w)) != 0) return false;
      }
    }
  }
  return true;
}

std::int64_t BitGrid::count(const LatticeBox& box) const {
  const LatticeBox b = clipped(box);
  std::int64_t sum = 0;
  for (std::int32_t z = b.low[2]; z < b.high[2]; ++z) {
    for (std::int32_t y = b.low[1]; y < b.high[1]; ++y) {
      const std::uint64_t* words = row(y, z);
      for (std::int32_t w = b.low[0] >> 6; w <= (b.high[0] - 1) >> 6; ++w) {
        sum += __builtin_popcountll(words[w] & maskOf(b, w));
      }
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

std::int64_t BitGrid::count() const {
  std::int64_t sum = 0;
  for (const std::uint64_t word : bits_) sum += __builtin_popcountll(word);
  return sum;
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
    for (std::size_t i = 0; i < before.size(); ++i) {
      const std::size_t at = i % period;
      if (at >= step) grid.bits_[i] |= before[i - step];
      if (at + step < period) grid.bits_[i] |= before[i + step];
    }
  };
  const std::size_t layer = words_ * static_cast<std::size_t>(size_[1]);
  if (axes[1] > 0 && layer > 0) spread(words_, layer);
  if (axes[2] > 0 && layer > 0) spread(layer, bits_.size());
  return grid;
}

}  // namespace planar_mapping::detail
