// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

namespace planar_mapping::detail {

/// Bits that are on. Without an instruction for it the compiler calls a function of its library
/// that looks up tables, which takes several times as long.
inline std::size_t bitCount(std::uint64_t bits) {
#ifdef __POPCNT__
  return static_cast<std::size_t>(__builtin_popcountll(bits));
#else
  bits -= bits >> 1u & 0x5555555555555555u;
  bits = (bits & 0x3333333333333333u) + (bits >> 2u & 0x3333333333333333u);
  bits = (bits + (bits >> 4u)) & 0x0f0f0f0f0f0f0f0fu;
  return static_cast<std::size_t>(bits * 0x0101010101010101u >> 56u);
#endif
}

using LatticeCell = std::array<std::int32_t, 3>;  ///< x, y, z

/// Cells [low, high) of a window of a lattice; (0, 0, 0) is the window's corner.
struct LatticeBox {
  LatticeCell low{};
  LatticeCell high{};

  std::int32_t size(std::size_t axis) const { return high[axis] - low[axis]; }
  bool operator==(const LatticeBox& o) const { return low == o.low && high == o.high; }
  bool operator<(const LatticeBox& o) const {
    return std::tie(low, high) < std::tie(o.low, o.high);
  }
};

/// A window of on/off cells, packed along x.
class BitGrid {
 public:
  BitGrid(std::int32_t width, std::int32_t height, std::int32_t depth)
      : size_{width, height, depth},
        words_((static_cast<std::size_t>(width) + 63) / 64),
        bits_(words_ * static_cast<std::size_t>(height) * static_cast<std::size_t>(depth), 0) {}

  const std::array<std::int32_t, 3>& size() const { return size_; }
  bool contains(const LatticeBox& box) const;
  bool at(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return (row(y, z)[x >> 6] >> (x & 63) & 1u) != 0;
  }
  /// False for a cell outside the window.
  bool holds(const LatticeCell& c) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (c[k] < 0 || c[k] >= size_[k]) return false;
    }
    return at(c[0], c[1], c[2]);
  }
  void set(std::int32_t x, std::int32_t y, std::int32_t z) {
    row(y, z)[x >> 6] |= std::uint64_t{1} << (x & 63);
  }
  void reset(std::int32_t x, std::int32_t y, std::int32_t z) {
    row(y, z)[x >> 6] &= ~(std::uint64_t{1} << (x & 63));
  }
  /// Are all cells of the box on? False if it leaves the window.
  bool all(const LatticeBox& box) const;
  /// Moves the upper or lower face of a box within the window outwards along the axis, as long as
  /// all cells of the layers that are added are on.
  void extendUp(LatticeBox& box, std::size_t axis) const;
  void extendDown(LatticeBox& box, std::size_t axis) const;
  /// Number of cells that are on; what lies outside the window is off.
  std::int64_t count(const LatticeBox& box) const;
  void clear(const LatticeBox& box);
  /// Clears the cell and those stored together with it.
  void clearWordOf(const LatticeCell& c) { row(c[1], c[2])[c[0] >> 6] = 0; }
  /// The box must lie within the window.
  void fill(const LatticeBox& box);
  std::int64_t count() const { return count(window()); }
  /// With all cells that differ by at most one along each axis of \p axes from one that is on.
  BitGrid dilated(std::array<std::int32_t, 3> axes) const;
  /// Calls visit(x, y, z) for the cells of the box that are on, by z, y, x.
  template <typename Visit>
  void forEach(const LatticeBox& box, Visit&& visit) const {
    const LatticeBox b = clipped(box);
    for (std::int32_t z = b.low[2]; z < b.high[2]; ++z) {
      for (std::int32_t y = b.low[1]; y < b.high[1]; ++y) {
        const std::uint64_t* words = row(y, z);
        for (std::int32_t w = b.low[0] >> 6; w <= (b.high[0] - 1) >> 6; ++w) {
          for (std::uint64_t left = words[w] & maskOf(b, w); left != 0; left &= left - 1) {
            visit(64 * w + __builtin_ctzll(left), y, z);
          }
        }
      }
    }
  }
  /// Calls visit(block) for the blocks of kBlock x kBlock x kBlock cells, counted from the window's
  /// corner, in which any cell is on; by z, y, x. Cells of the block may be switched off meanwhile.
  static constexpr std::int32_t kBlock = 8;
  template <typename Visit>
  void forEachBlock(Visit&& visit) const {
    for (std::int32_t z = 0; z < size_[2]; z += kBlock) {
      for (std::int32_t y = 0; y < size_[1]; y += kBlock) {
        const LatticeBox rows{{0, y, z}, {size_[0], y + kBlock, z + kBlock}};
        for (std::size_t w = 0; w < words_; ++w) {
          const std::uint64_t on = anyBits(rows, w);
          for (std::int32_t k = 0; on >> k != 0; k += kBlock) {
            if ((on >> k & 0xFFu) == 0) continue;
            const auto x = static_cast<std::int32_t>(64 * w) + k;
            visit(LatticeBox{{x, y, z}, {x + kBlock, y + kBlock, z + kBlock}});
            if (k + kBlock >= 64) break;
          }
        }
      }
    }
  }
  /// The least box that holds all cells that are on; an empty one where there are none.
  LatticeBox hull() const;
  /// The cells of a box within the window, as a window of its own.
  BitGrid cropped(const LatticeBox& box) const;
  LatticeBox window() const { return {{0, 0, 0}, size_}; }

 private:
  friend class CellNumbers;
  const std::uint64_t* row(std::int32_t y, std::int32_t z) const {
    return bits_.data() + (static_cast<std::size_t>(z) * static_cast<std::size_t>(size_[1]) +
                           static_cast<std::size_t>(y)) *
                              words_;
  }
  std::uint64_t* row(std::int32_t y, std::int32_t z) {
    return const_cast<std::uint64_t*>(static_cast<const BitGrid*>(this)->row(y, z));
  }
  LatticeBox clipped(const LatticeBox& box) const;
  std::int32_t layersOn(const LatticeBox& box, std::size_t axis, bool up) const;
  std::uint64_t commonBits(const LatticeBox& box, std::int32_t w, std::uint64_t asked) const;
  std::uint64_t anyBits(const LatticeBox& rows, std::size_t w) const;
  /// Bits of word \p w within the box.
  static std::uint64_t maskOf(const LatticeBox& box, std::int32_t w) {
    std::uint64_t mask = ~std::uint64_t{0};
    if (box.low[0] > 64 * w) mask <<= (box.low[0] & 63);
    if (box.high[0] < 64 * (w + 1)) mask &= (std::uint64_t{1} << (box.high[0] & 63)) - 1;
    return mask;
  }

  std::array<std::int32_t, 3> size_;
  std::size_t words_;
  std::vector<std::uint64_t> bits_;
};

/// Numbers the cells of a grid that are on.
class CellNumbers {
 public:
  explicit CellNumbers(const BitGrid& grid) : grid_(grid), before_(grid.bits_.size()) {
    std::int32_t sum = 0;
    for (std::size_t i = 0; i < before_.size(); ++i) {
      before_[i] = sum;
      sum += static_cast<std::int32_t>(bitCount(grid.bits_[i]));
    }
    count_ = static_cast<std::size_t>(sum);
  }
  std::size_t count() const { return count_; }
  /// Calls visit(number) for the cells of the box that are on, ascending.
  template <typename Visit>
  void forEach(const LatticeBox& box, Visit&& visit) const {
    const LatticeBox b = grid_.clipped(box);
    for (std::int32_t z = b.low[2]; z < b.high[2]; ++z) {
      for (std::int32_t y = b.low[1]; y < b.high[1]; ++y) {
        const std::uint64_t* words = grid_.row(y, z);
        for (std::int32_t w = b.low[0] >> 6; w <= (b.high[0] - 1) >> 6; ++w) {
          std::uint64_t left = words[w] & BitGrid::maskOf(b, w);
          if (left == 0) continue;
          // The bits of the box lie one after the other, and so do their numbers.
          std::size_t number = numberOf(words + w, __builtin_ctzll(left));
          for (; left != 0; left &= left - 1) visit(number++);
        }
      }
    }
  }
  std::size_t at(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return numberOf(grid_.row(y, z) + (x >> 6), x & 63);
  }

 private:
  std::size_t numberOf(const std::uint64_t* word, std::int32_t bit) const {
    const std::uint64_t below = *word & ((std::uint64_t{1} << bit) - 1);
    return static_cast<std::size_t>(before_[static_cast<std::size_t>(word - grid_.bits_.data())]) +
           bitCount(below);
  }

  const BitGrid& grid_;
  std::vector<std::int32_t> before_;
  std::size_t count_ = 0;
};

}  // namespace planar_mapping::detail
