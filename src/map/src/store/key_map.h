// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <tuple>
#include <utility>
#include <vector>

#include "store/heap_bytes.h"

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
/// By z, then y, then x.
inline bool isBefore(const Int3& a, const Int3& b) {
  return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x);
}

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
extern const std::uint64_t kHashSeed;

/// Open-addressing hash from 64-bit keys to values kept in insertion order. Results must not
/// depend on that order where a map and its reloaded copy have to agree: sort the keys there.
///
/// Maps hold many of these with few entries: each is one block of memory, of the values, their keys
/// and the table of positions, and a few entries need no table.
template <typename Value>
class KeyMap {
 public:
  KeyMap() = default;
  KeyMap(const KeyMap& other) {
    resizeTo(other.size_);
    for (; size_ < other.size_; ++size_) new (&values()[size_]) Value(other.values()[size_]);
    std::copy_n(other.keyData(), size_, keyData());
    rehash();
  }
  KeyMap(KeyMap&& other) noexcept { swap(other); }
  KeyMap& operator=(const KeyMap& other) {
    if (this != &other) *this = KeyMap(other);
    return *this;
  }
  KeyMap& operator=(KeyMap&& other) noexcept {
    KeyMap taken(std::move(other));
    swap(taken);
    return *this;
  }
  ~KeyMap() {
    std::destroy_n(values(), size_);
    ::operator delete(block_);
  }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  std::uint64_t key(std::size_t i) const { return keyData()[i]; }
  Value& value(std::size_t i) { return values()[i]; }
  const Value& value(std::size_t i) const { return values()[i]; }
  std::vector<std::uint64_t> keys() const { return {keyData(), keyData() + size_}; }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  /// Position of the key, or kNone.
  std::size_t indexOf(std::uint64_t key) const {
    const std::uint64_t* keys = keyData();
    const std::size_t count = slotsFor(capacity_);
    if (count == 0) {
      for (std::size_t i = 0; i < size_; ++i) {
        if (keys[i] == key) return i;
      }
      return kNone;
    }
    const std::uint32_t* slots = slotData();
    for (std::size_t at = hash(key) & (count - 1);; at = (at + 1) & (count - 1)) {
      if (slots[at] == 0) return kNone;
      if (keys[slots[at] - 1] == key) return slots[at] - 1;
    }
  }
  Value* find(std::uint64_t key) {
    const std::size_t i = indexOf(key);
    return i == kNone ? nullptr : &values()[i];
  }
  const Value* find(std::uint64_t key) const {
    const std::size_t i = indexOf(key);
    return i == kNone ? nullptr : &values()[i];
  }
  /// Position of the key, which is added with a default value if it is new.
  std::size_t insert(std::uint64_t key) {
    const std::size_t found = indexOf(key);
    if (found != kNone) return found;
    // By a quarter: maps are measured by their memory, and entries are large.
    if (size_ == capacity_) resizeTo(size_ + std::max(size_ / 4, 1u));
    new (&values()[size_]) Value();
    keyData()[size_] = key;
    if (slotsFor(capacity_) != 0) enter(size_);
    return size_++;
  }
  Value& operator[](std::uint64_t key) {
    const std::size_t i = insert(key);  // may move the values
    return values()[i];
  }

  /// Makes room for so many entries in all.
  void reserve(std::size_t capacity) {
    if (capacity > capacity_) resizeTo(capacity);
  }

  /// Removes the entries that the predicate (key, value) names; the others keep their order.
  template <typename Predicate>
  void removeIf(Predicate&& predicate) {
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < size_; ++i) {
      if (predicate(key(i), value(i))) continue;
      if (kept != i) {
        keyData()[kept] = keyData()[i];
        values()[kept] = std::move(values()[i]);
      }
      ++kept;
    }
    if (kept == size_) return;
    std::destroy_n(values() + kept, size_ - kept);
    size_ = kept;
    rehash();
  }
  /// Forgets the entries and keeps the memory.
  void clear() {
    std::destroy_n(values(), size_);
    size_ = 0;
    rehash();
  }
  std::size_t memoryBytes() const { return heapBytes(bytesFor(capacity_)); }

 private:
  static_assert(alignof(Value) <= alignof(std::max_align_t));
  static constexpr std::size_t kFew = 8;  ///< so many are found by looking at all

  /// Size of the table: a power of two, of which at most three quarters are used.
  static std::size_t slotsFor(std::size_t capacity) {
    if (capacity <= kFew) return 0;
    const auto least = static_cast<std::uint64_t>(capacity + capacity / 3);
    return std::size_t{2} << (63 - __builtin_clzll(least - 1));
  }
  static std::size_t keysAt(std::size_t capacity) {
    constexpr std::size_t kStep = alignof(std::uint64_t);
    return (capacity * sizeof(Value) + kStep - 1) / kStep * kStep;
  }
  static std::size_t slotsAt(std::size_t capacity) {
    return keysAt(capacity) + capacity * sizeof(std::uint64_t);
  }
  static std::size_t bytesFor(std::size_t capacity) {
    return slotsAt(capacity) + slotsFor(capacity) * sizeof(std::uint32_t);
  }
  Value* values() const { return reinterpret_cast<Value*>(block_); }
  std::uint64_t* keyData() const {
    return reinterpret_cast<std::uint64_t*>(block_ + keysAt(capacity_));
  }
  /// Position + 1, 0 = empty.
  std::uint32_t* slotData() const {
    return reinterpret_cast<std::uint32_t*>(block_ + slotsAt(capacity_));
  }
  static std::size_t hash(std::uint64_t key) {
    key ^= kHashSeed;
    key ^= key >> 30u;
    key *= 0xbf58476d1ce4e5b9ULL;
    key ^= key >> 27u;
    key *= 0x94d049bb133111ebULL;
    return static_cast<std::size_t>(key ^ (key >> 31u));
  }
  void enter(std::size_t i) {
    std::uint32_t* slots = slotData();
    const std::size_t mask = slotsFor(capacity_) - 1;
    std::size_t at = hash(keyData()[i]) & mask;
    while (slots[at] != 0) at = (at + 1) & mask;
    slots[at] = static_cast<std::uint32_t>(i + 1);
  }
  void rehash() {
    const std::size_t count = slotsFor(capacity_);
    if (count == 0) return;
    std::fill_n(slotData(), count, 0u);
    for (std::size_t i = 0; i < size_; ++i) enter(i);
  }
  /// Makes room for \p capacity >= size() entries.
  void resizeTo(std::size_t capacity) {
    if (capacity == 0) return;
    if (capacity > UINT32_MAX) throw std::bad_alloc();
    KeyMap larger;
    larger.block_ = static_cast<std::byte*>(::operator new(bytesFor(capacity)));
    larger.capacity_ = static_cast<std::uint32_t>(capacity);
    std::uninitialized_move_n(values(), size_, larger.values());
    std::copy_n(keyData(), size_, larger.keyData());
    larger.size_ = size_;
    const std::size_t count = slotsFor(capacity);
    if (count != 0 && count == slotsFor(capacity_)) {
      std::copy_n(slotData(), count, larger.slotData());
    } else {
      larger.rehash();
    }
    swap(larger);
  }
  void swap(KeyMap& other) noexcept {
    std::swap(block_, other.block_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }

  std::byte* block_ = nullptr;
  std::uint32_t size_ = 0;
  std::uint32_t capacity_ = 0;
};

}  // namespace planar_mapping::detail
