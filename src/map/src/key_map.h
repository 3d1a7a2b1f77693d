// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace planar_mapping::detail {

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

struct Int3 {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t z = 0;
  bool operator==(const Int3& o) const { return x == o.x && y == o.y && z == o.z; }
};

/// Keys of three coordinates sort by z, then y, then x.
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

/// A number nobody outside this process knows: keys of a hostile file cannot be made to collide.
std::uint64_t hashSeed();

/// Open-addressing hash from 64-bit keys to values kept in insertion order. Results must not
/// depend on that order where a map and its reloaded copy have to agree: sort the keys there.
template <typename Value>
class KeyMap {
 public:
  std::size_t size() const { return keys_.size(); }
  bool empty() const { return keys_.empty(); }
  std::uint64_t key(std::size_t i) const { return keys_[i]; }
  Value& value(std::size_t i) { return values_[i]; }
  const Value& value(std::size_t i) const { return values_[i]; }
  const std::vector<std::uint64_t>& keys() const { return keys_; }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  /// Position of the key, or kNone.
  std::size_t indexOf(std::uint64_t key) const {
    if (slots_.empty()) return kNone;
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
    if ((keys_.size() + 1) * 4 > slots_.size() * 3) {
      rehash(slots_.empty() ? 4 : slots_.size() * 2);
    }
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t at = hash(key) & mask;; at = (at + 1) & mask) {
      if (slots_[at] == 0) {
        // By a quarter: maps are measured by their memory, and entries are large.
        if (keys_.size() == keys_.capacity()) {
          const std::size_t wanted = keys_.size() + keys_.size() / 4 + 1;
          keys_.reserve(wanted);
          values_.reserve(wanted);
        }
        keys_.push_back(key);
        values_.emplace_back();
        slots_[at] = static_cast<std::uint32_t>(keys_.size());
        return keys_.size() - 1;
      }
      if (keys_[slots_[at] - 1] == key) return slots_[at] - 1;
    }
  }
  Value& operator[](std::uint64_t key) { return values_[insert(key)]; }

  /// Removes the entries that the predicate (key, value) names; the others keep their order.
  template <typename Predicate>
  void removeIf(Predicate&& predicate) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      if (predicate(keys_[i], values_[i])) continue;
      if (kept != i) {
        keys_[kept] = keys_[i];
        values_[kept] = std::move(values_[i]);
      }
      ++kept;
    }
    if (kept == keys_.size()) return;
    keys_.resize(kept);
    values_.resize(kept);
    rehash(slots_.size());
  }
  /// Forgets the entries and keeps the memory.
  void clear() {
    std::fill(slots_.begin(), slots_.end(), 0u);
    keys_.clear();
    values_.clear();
  }
  std::size_t memoryBytes() const {
    return keys_.capacity() * sizeof(std::uint64_t) + values_.capacity() * sizeof(Value) +
           slots_.capacity() * sizeof(std::uint32_t);
  }

 private:
  std::size_t hash(std::uint64_t key) const {
    key ^= seed_;
    key ^= key >> 30u;
    key *= 0xbf58476d1ce4e5b9ULL;
    key ^= key >> 27u;
    key *= 0x94d049bb133111ebULL;
    return static_cast<std::size_t>(key ^ (key >> 31u));
  }
  void rehash(std::size_t slots) {
    slots_.assign(slots, 0u);
    const std::size_t mask = slots - 1;
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      std::size_t at = hash(keys_[i]) & mask;
      while (slots_[at] != 0) at = (at + 1) & mask;
      slots_[at] = static_cast<std::uint32_t>(i + 1);
    }
  }

  std::uint64_t seed_ = hashSeed();
  std::vector<std::uint64_t> keys_;
  std::vector<Value> values_;
  std::vector<std::uint32_t> slots_;  ///< position + 1, 0 = empty; a power of two of them
};

}  // namespace planar_mapping::detail
