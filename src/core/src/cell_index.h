// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace planar_mapping::detail {

using CellKey = std::array<std::int32_t, 3>;  ///< x, y, z

/// Position of each cell in a list, by open addressing. No allocation per cell and nothing depends
/// on the order of insertion but the answer to at().
class CellIndex {
 public:
  /// \param cells distinct cells; not kept
  explicit CellIndex(const std::vector<CellKey>& cells) {
    std::size_t capacity = 16;
    while (capacity < 2 * cells.size()) capacity *= 2;
    mask_ = capacity - 1;
    slots_.resize(capacity);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      std::size_t slot = hash(cells[i]) & mask_;
      while (slots_[slot].position >= 0) slot = (slot + 1) & mask_;
      slots_[slot] = {cells[i], static_cast<std::int32_t>(i)};
    }
  }

  /// -1 if the cell is not in the list.
  std::int32_t at(const CellKey& cell) const {
    std::size_t slot = hash(cell) & mask_;
    while (slots_[slot].position >= 0 && slots_[slot].key != cell) slot = (slot + 1) & mask_;
    return slots_[slot].position;
  }

 private:
  struct Slot {
    CellKey key{};
    std::int32_t position = -1;
  };

  static std::size_t hash(const CellKey& cell) {
    std::uint64_t h = static_cast<std::uint32_t>(cell[0]) * 0x9E3779B97F4A7C15ULL;
    h = (h ^ (h >> 32u) ^ static_cast<std::uint32_t>(cell[1])) * 0xC2B2AE3D27D4EB4FULL;
    h = (h ^ (h >> 32u) ^ static_cast<std::uint32_t>(cell[2])) * 0x9E3779B97F4A7C15ULL;
    return static_cast<std::size_t>(h ^ (h >> 29u));
  }

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
