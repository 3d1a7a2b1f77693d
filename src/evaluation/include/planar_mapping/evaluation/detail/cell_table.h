// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "planar_mapping/core/base/types.h"
#include "planar_mapping/evaluation/grid_cell.h"

namespace planar_mapping::evaluation::detail {

/// Bits it takes to tell \p values different values apart.
inline int bitsFor(double values) {
  return values <= 1.0 ? 0 : static_cast<int>(std::ceil(std::log2(values)));
}

inline std::size_t bytesOfBits(std::size_t count, int bits) {
  return (count * static_cast<std::size_t>(bits) + 7) / 8;
}

constexpr int kCellBits = 21;                                            ///< of a key, an axis
constexpr std::int64_t kCellLimit = std::int64_t{1} << (kCellBits - 1);  ///< cells from the origin

/// The cell as one number; keys sort by z, then y, then x.
inline std::uint64_t packCell(std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto part = [](std::int64_t v) { return static_cast<std::uint64_t>(v + kCellLimit); };
  return (((part(z) << kCellBits) | part(y)) << kCellBits) | part(x);
}

/// x, y or z of a key for axis 0, 1, 2.
inline std::int32_t unpackCell(std::uint64_t key, int axis) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kCellBits) - 1;
  return static_cast<std::int32_t>(static_cast<std::int64_t>((key >> (axis * kCellBits)) & kMask) -
                                   kCellLimit);
}

inline GridCell cellOf(std::uint64_t key) {
  return {unpackCell(key, 0), unpackCell(key, 1), unpackCell(key, 2)};
}

/// Key of the cell a point is in; false for points that are not finite or beyond kCellLimit.
inline bool cellKeyOf(const Vector3& point, double side, std::uint64_t& key) {
  std::int64_t cell[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double number = std::floor(point[axis] / side);
    if (!(std::abs(number) < static_cast<double>(kCellLimit))) return false;
    cell[axis] = static_cast<std::int64_t>(number);
  }
  key = packCell(cell[0], cell[1], cell[2]);
  return true;
}

/// Values of cells by their keys, in an open addressing table: two arrays of the same length and
/// nothing else.
template <typename Value>
class CellTable {
 public:
  std::size_t size() const { return size_; }

  /// Value of the cell, a new one if it was not there. Valid until the next call.
  Value& operator[](std::uint64_t key) {
    const std::uint64_t stored = key + 1;
    if (!keys_.empty() && keys_[last_] == stored) return values_[last_];
    if (kMaxFilled * static_cast<double>(keys_.size()) < static_cast<double>(size_ + 1)) grow();
    last_ = slotOf(stored);
    if (keys_[last_] == 0) {
      keys_[last_] = stored;
      ++size_;
    }
    return values_[last_];
  }
  const Value* find(std::uint64_t key) const {
    if (keys_.empty()) return nullptr;
    const std::size_t slot = slotOf(key + 1);
    return keys_[slot] == 0 ? nullptr : &values_[slot];
  }
  Value* find(std::uint64_t key) {
    return const_cast<Value*>(static_cast<const CellTable*>(this)->find(key));
  }
  /// Removes the cells that the predicate (key, value) names.
  template <typename Predicate>
  void removeIf(const Predicate& predicate) {
    CellTable kept;
    forEach([&](std::uint64_t key, const Value& value) {
      if (!predicate(key, value)) kept[key] = value;
    });
    if (kept.size() < size_) *this = std::move(kept);
  }
  /// visit(key, value) for each cell; the order follows from the cells and how they came.
  template <typename Visitor>
  void forEach(const Visitor& visit) const {
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      if (keys_[i] != 0) visit(keys_[i] - 1, values_[i]);
    }
  }
  std::size_t memoryBytes() const {
    return keys_.capacity() * sizeof(std::uint64_t) + values_.capacity() * sizeof(Value);
  }

 private:
  static constexpr double kMaxFilled = 0.75;

  std::size_t slotOf(std::uint64_t stored) const {
    const std::size_t mask = keys_.size() - 1;
    std::uint64_t hash = (stored ^ (stored >> 32u)) * 0x9E3779B97F4A7C15ULL;
    hash ^= hash >> 29u;
    std::size_t slot = static_cast<std::size_t>(hash) & mask;
    while (keys_[slot] != 0 && keys_[slot] != stored) slot = (slot + 1) & mask;
    return slot;
  }
  void grow() {
    const std::size_t slots = keys_.empty() ? 64 : 2 * keys_.size();
    const std::vector<std::uint64_t> old_keys =
        std::exchange(keys_, std::vector<std::uint64_t>(slots));
    std::vector<Value> old_values = std::exchange(values_, std::vector<Value>(slots));
    for (std::size_t i = 0; i < old_keys.size(); ++i) {
      if (old_keys[i] == 0) continue;
      const std::size_t slot = slotOf(old_keys[i]);
      keys_[slot] = old_keys[i];
      values_[slot] = std::move(old_values[i]);
    }
  }

  std::vector<std::uint64_t> keys_;  ///< + 1; 0 = free; a power of two of them
  std::vector<Value> values_;
  std::size_t size_ = 0;
  std::size_t last_ = 0;  ///< slot; neighbouring points are mostly in the same cell
};

}  // namespace planar_mapping::evaluation::detail
