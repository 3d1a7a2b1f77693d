// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/int3.h"

namespace planar_mapping::detail {

using CellKey = Int3;

/// The cell of a place in units of the side; false beyond 2^30 cells and for what is not a number.
inline bool cellOf(const Vector3& place, CellKey& key) {
  constexpr double kFarthest = 1 << 30;
  if (!(place.array().abs() < kFarthest).all()) return false;
  const auto down = [](double v) {
    const auto whole = static_cast<std::int32_t>(v);
    return whole - static_cast<std::int32_t>(v < whole);
  };
  key = {down(place.x()), down(place.y()), down(place.z())};
  return true;
}

/// Hash table from cells to consecutive numbers in order of insertion.
class CellTable {
 public:
  explicit CellTable(std::size_t expected = 1024) { grow(expected); }

  /// Number of the cell, or -1.
  std::int32_t find(const CellKey& key) const {
    for (std::size_t slot = start(key);; slot = (slot + 1) & mask_) {
      if (slots_[slot].number < 0 || slots_[slot].key == key) return slots_[slot].number;
    }
  }
  /// Number of the cell, a new one if it was not there.
  std::int32_t insert(const CellKey& key) {
    std::size_t slot = start(key);
    for (; slots_[slot].number >= 0; slot = (slot + 1) & mask_) {
      if (slots_[slot].key == key) return slots_[slot].number;
    }
    const auto number = static_cast<std::int32_t>(keys_.size());
    slots_[slot] = {key, number};
    keys_.push_back(key);
    if (2 * keys_.size() > mask_) grow(2 * keys_.size());
    return number;
  }
  std::size_t size() const { return keys_.size(); }
  const CellKey& key(std::size_t number) const { return keys_[number]; }

 private:
  struct Slot {
    CellKey key;
    std::int32_t number = -1;
  };

  std::size_t start(const CellKey& key) const {
    std::uint64_t h = static_cast<std::uint32_t>(key.x) * 0x9E3779B97F4A7C15ULL +
                      static_cast<std::uint32_t>(key.y) * 0xC2B2AE3D27D4EB4FULL +
                      static_cast<std::uint32_t>(key.z) * 0x165667B19E3779F9ULL;
    h ^= h >> 32u;
    h *= 0xD6E8FEB86659FD93ULL;
    return static_cast<std::size_t>(h >> 32u) & mask_;
  }
  void grow(std::size_t cells) {
    std::size_t slots = 1024;
    while (slots < 2 * cells) slots *= 2;
    slots_.assign(slots, Slot());
    mask_ = slots - 1;
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      std::size_t slot = start(keys_[i]);
      while (slots_[slot].number >= 0) slot = (slot + 1) & mask_;
      slots_[slot] = {keys_[i], static_cast<std::int32_t>(i)};
    }
  }

  std::vector<Slot> slots_;
  std::vector<CellKey> keys_;
  std::size_t mask_ = 0;
};

/// Connected component of each cell, numbered from 0 by their first cells; neighbours are at most
/// so many cells apart along each axis.
inline std::vector<std::int32_t> componentsOf(const CellTable& cells, const CellKey& reach) {
  std::vector<std::int32_t> component(cells.size(), -1);
  std::vector<std::size_t> open;
  std::int32_t count = 0;
  for (std::size_t start = 0; start < cells.size(); ++start) {
    if (component[start] >= 0) continue;
    component[start] = count;
    open.assign(1, start);
    while (!open.empty()) {
      const CellKey at = cells.key(open.back());
      open.pop_back();
      for (std::int64_t z = std::int64_t{at.z} - reach.z; z <= std::int64_t{at.z} + reach.z; ++z) {
        for (std::int64_t y = std::int64_t{at.y} - reach.y; y <= std::int64_t{at.y} + reach.y;
             ++y) {
          for (std::int64_t x = std::int64_t{at.x} - reach.x; x <= std::int64_t{at.x} + reach.x;
               ++x) {
            const CellKey key{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                              static_cast<std::int32_t>(z)};
            if (key.x != x || key.y != y || key.z != z) continue;  // beyond the range of numbers
            const std::int32_t next = cells.find(key);
            if (next < 0 || component[static_cast<std::size_t>(next)] >= 0) continue;
            component[static_cast<std::size_t>(next)] = count;
            open.push_back(static_cast<std::size_t>(next));
          }
        }
      }
    }
    ++count;
  }
  return component;
}

}  // namespace planar_mapping::detail
