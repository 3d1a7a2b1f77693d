// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace planar_mapping::detail {

using CellKey = std::array<std::int32_t, 3>;  ///< x, y, z

/// Numbers cells in the order in which they come, by open addressing.
class CellNumbering {
 public:
  explicit CellNumbering(std::size_t expected = 0) { rebuild(2 * expected); }
  /// \param cells distinct; each gets its position as number
  explicit CellNumbering(const std::vector<CellKey>& cells) : CellNumbering(cells.size()) {
    for (const CellKey& cell : cells) insert(cell);
  }

  /// Number of the cell, -1 if it is not there.
  std::int32_t at(const CellKey& cell) const { return slots_[slotOf(cell)].number; }

  /// Number of the cell, a new one if it was not there.
  std::int32_t insert(const CellKey& cell) {
    std::size_t slot = slotOf(cell);
    if (slots_[slot].number >= 0) return slots_[slot].number;
    if (2 * (size_ + 1) > slots_.size()) {
      rebuild(4 * size_);
      slot = slotOf(cell);
    }
    slots_[slot] = {cell, static_cast<std::int32_t>(size_)};
    return static_cast<std::int32_t>(size_++);
  }

  std::size_t size() const { return size_; }

 private:
  struct Slot {
    CellKey key{};
    std::int32_t number = -1;
  };

  std::size_t slotOf(const CellKey& cell) const {
    std::size_t slot = hash(cell) & mask_;
    while (slots_[slot].number >= 0 && !isSame(slots_[slot].key, cell)) slot = (slot + 1) & mask_;
    return slot;
  }

  void rebuild(std::size_t least) {
    std::size_t capacity = 16;
    while (capacity < least) capacity *= 2;
    const std::vector<Slot> old = std::exchange(slots_, std::vector<Slot>(capacity));
    mask_ = capacity - 1;
    for (const Slot& slot : old) {
      if (slot.number >= 0) slots_[slotOf(slot.key)] = slot;
    }
  }

  // Not operator==, which calls memcmp.
  static bool isSame(const CellKey& l, const CellKey& r) {
    return ((l[0] ^ r[0]) | (l[1] ^ r[1]) | (l[2] ^ r[2])) == 0;
  }

  static std::size_t hash(const CellKey& cell) {
    std::uint64_t h = static_cast<std::uint32_t>(cell[0]) * 0x9E3779B97F4A7C15ULL;
    h = (h ^ (h >> 32u) ^ static_cast<std::uint32_t>(cell[1])) * 0xC2B2AE3D27D4EB4FULL;
    h = (h ^ (h >> 32u) ^ static_cast<std::uint32_t>(cell[2])) * 0x9E3779B97F4A7C15ULL;
    return static_cast<std::size_t>(h ^ (h >> 29u));
  }

  std::size_t size_ = 0;
  std::size_t mask_ = 0;
  std::vector<Slot> slots_;
};

/// The neighbouring coordinate, or false at the end of the number range.
inline bool step(CellKey& cell, std::size_t axis, int direction) {
  const std::int64_t moved = static_cast<std::int64_t>(cell[axis]) + direction;
  if (moved < INT32_MIN || moved > INT32_MAX) return false;
  cell[axis] = static_cast<std::int32_t>(moved);
  return true;
}

}  // namespace planar_mapping::detail
