// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/int3.h"

namespace planar_mapping::detail {

template <typename T>
std::size_t capacityBytes(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

/// Lattice coordinates stay within +-kLatticeLimit, so that three of them fit a 64-bit key.
constexpr std::int32_t kLatticeLimit = 1 << 20;

inline std::uint64_t packKey(std::int32_t a, std::int32_t b) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(b)) << 32u) |
         static_cast<std::uint32_t>(a);
}
inline void unpackKey(std::uint64_t key, std::int32_t& a, std::int32_t& b) {
  a = static_cast<std::int32_t>(static_cast<std::uint32_t>(key));
  b = static_cast<std::int32_t>(static_cast<std::uint32_t>(key >> 32u));
}

/// Keys of three coordinates sort as Int3 does.
inline std::uint64_t packKey(const Int3& c) {
  const auto part = [](std::int32_t v) {
    return static_cast<std::uint64_t>(v + kLatticeLimit) & 0x1fffffu;
  };
  return (part(c.z) << 42u) | (part(c.y) << 21u) | part(c.x);
}
inline Int3 unpackKey(std::uint64_t key) {
  const auto part = [](std::uint64_t v) {
    return static_cast<std::int32_t>(v & 0x1fffffu) - kLatticeLimit;
  };
  return {part(key), part(key >> 21u), part(key >> 42u)};
}

/// Of whole numbers in the range of 32 bits.
inline Int3 toInt3(const Vector3& whole) {
  return {static_cast<std::int32_t>(whole.x()), static_cast<std::int32_t>(whole.y()),
          static_cast<std::int32_t>(whole.z())};
}

/// Calls visit(bit) for each bit that is set, the lowest first.
template <typename Visit>
void forEachBit(std::uint64_t bits, Visit&& visit) {
  for (; bits != 0; bits &= bits - 1) visit(static_cast<std::size_t>(__builtin_ctzll(bits)));
}

/// Calls visit(place) for the places from \p low to \p high, both included, as long as that gives
/// true. \return was that always
template <typename Visit>
bool allPlaces(const Int3& low, const Int3& high, Visit&& visit) {
  Int3 at;
  for (at.z = low.z; at.z <= high.z; ++at.z) {
    for (at.y = low.y; at.y <= high.y; ++at.y) {
      for (at.x = low.x; at.x <= high.x; ++at.x) {
        if (!visit(at)) return false;
      }
    }
  }
  return true;
}

/// Calls visit(place) for all places from \p low to \p high, both included.
template <typename Visit>
void forEachPlace(const Int3& low, const Int3& high, Visit&& visit) {
  allPlaces(low, high, [&](const Int3& at) {
    visit(at);
    return true;
  });
}

/// A number nobody outside this process knows: keys of a hostile file cannot be made to collide.
PLANAR_MAPPING_EXPORT extern const std::uint64_t kHashSeed;

/// Open-addressing hash table from 64-bit keys to values, which stay in insertion order. Results
/// must not depend on that order where a map and its reloaded copy have to agree: sort the keys
/// there.
template <typename Value>
class KeyMap {
 public:
  std::size_t size() const { return keys_.size(); }
  bool empty() const { return keys_.empty(); }
  std::uint64_t key(std::size_t i) const { return keys_[i]; }
  Value& value(std::size_t i) { return values_[i]; }
  const Value& value(std::size_t i) const { return values_[i]; }
  const std::vector<std::uint64_t>& keys() const { return keys_; }
  std::vector<std::uint64_t> sortedKeys() const {
    std::vector<std::uint64_t> keys = keys_;
    std::sort(keys.begin(), keys.end());
    return keys;
  }
  std::vector<Value>& values() { return values_; }
  const std::vector<Value>& values() const { return values_; }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  /// Position of the key, or kNone.
  std::size_t indexOf(std::uint64_t key) const {
    if (slots_.empty()) {
      const auto found = std::find(keys_.begin(), keys_.end(), key);
      return found == keys_.end() ? kNone : static_cast<std::size_t>(found - keys_.begin());
    }
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t at = hash(key) & mask;; at = (at + 1) & mask) {
      if (slots_[at] == 0) return kNone;
      if (keys_[slots_[at] - 1] == key) return slots_[at] - 1;
    }
  }
  Value* find(std::uint64_t key) {
    const std::size_t i = indexOf(key);
    return i == kNone ? nullptr : &values_[i];
  }
  const Value* find(std::uint64_t key) const {
    const std::size_t i = indexOf(key);
    return i == kNone ? nullptr : &values_[i];
  }
  /// Position of the key, which is added with a default value if it is new.
  std::size_t insert(std::uint64_t key) {
    const std::size_t found = indexOf(key);
    if (found != kNone) return found;
    if (size() == UINT32_MAX) throw std::bad_alloc();
    if (size() == keys_.capacity()) {  // by a quarter: there are many tables, and values are large
      keys_.reserve(size() + size() / 4 + 1);
      values_.reserve(size() + size() / 4 + 1);
    }
    keys_.push_back(key);
    values_.emplace_back();
    if (4 * size() > 3 * slots_.size()) {
      rehash();
    } else {
      enter(size() - 1);
    }
    return size() - 1;
  }
  Value& operator[](std::uint64_t key) {
    const std::size_t i = insert(key);  // may move the values
    return values_[i];
  }

  /// Removes the entries that the predicate (key, value) names; the others keep their order.
  template <typename Predicate>
  void removeIf(Predicate&& predicate) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < size(); ++i) {
      if (predicate(keys_[i], values_[i])) continue;
      if (kept != i) {
        keys_[kept] = keys_[i];
        values_[kept] = std::move(values_[i]);
      }
      ++kept;
    }
    if (kept == size()) return;
    keys_.resize(kept);
    values_.resize(kept);
    rehash();
  }
  /// Capacity in bytes, beside what the values themselves hold.
  std::size_t memoryBytes() const {
    return capacityBytes(keys_) + capacityBytes(values_) + capacityBytes(slots_);
  }

 private:
  static constexpr std::size_t kFew = 8;  ///< so many are found by a linear search

  static std::size_t hash(std::uint64_t key) {
    key ^= kHashSeed;
    key ^= key >> 30u;
    key *= 0xbf58476d1ce4e5b9ULL;
    key ^= key >> 27u;
    key *= 0x94d049bb133111ebULL;
    return static_cast<std::size_t>(key ^ (key >> 31u));
  }
  void enter(std::size_t i) {
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = hash(keys_[i]) & mask;
    while (slots_[at] != 0) at = (at + 1) & mask;
    slots_[at] = static_cast<std::uint32_t>(i + 1);
  }
  /// Makes room for half as many keys again.
  void rehash() {
    slots_.clear();
    if (size() <= kFew) return;
    std::size_t count = 16;
    while (count < 2 * size()) count *= 2;
    slots_.resize(count);
    for (std::size_t i = 0; i < size(); ++i) enter(i);
  }

  std::vector<std::uint64_t> keys_;
  std::vector<Value> values_;
  std::vector<std::uint32_t> slots_;  ///< position + 1, 0 = empty
};

}  // namespace planar_mapping::detail
