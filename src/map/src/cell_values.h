// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>

namespace planar_mapping::detail {

/// A number below 2^kBits, kBits <= 8, for each cell of a bundle of 64 that is set, in the order of
/// their bits. Costs eight bytes as long as all are alike, as most are.
///
/// The set cells are kept by the caller, who hands them over; positions are bits that are set.
template <unsigned kBits>
class CellValues {
 public:
  CellValues() = default;
  CellValues(const CellValues& other) : alike_(other.alike_) {
    if (other.values_ == nullptr) return;
    values_ = std::make_unique<std::uint8_t[]>(bytesFor(other.room()));
    std::memcpy(values_.get(), other.values_.get(), bytesFor(other.room()));
  }
  CellValues(CellValues&& other) noexcept = default;
  CellValues& operator=(const CellValues& other) {
    if (this != &other) *this = CellValues(other);
    return *this;
  }
  CellValues& operator=(CellValues&& other) noexcept = default;

  std::uint8_t get(std::uint64_t cells, std::size_t bit) const {
    return values_ == nullptr ? alike_ : read(rank(cells, bit));
  }
  /// Sets the value of a cell that is set.
  void set(std::uint64_t cells, std::size_t bit, std::uint8_t value) {
    if (values_ == nullptr) {
      if (value == alike_) return;
      const std::size_t count = rank(cells, 64);
      if (count == 1) {
        alike_ = value;
        return;
      }
      spread(count, count);
    }
    const std::size_t at = rank(cells, bit);
    if (read(at) == value) return;
    write(at, value);
    forgetIfAlike(rank(cells, 64));
  }
  /// Makes room for a cell that is not set yet.
  void insert(std::uint64_t cells, std::size_t bit, std::uint8_t value) {
    const std::size_t count = rank(cells, 64);
    if (values_ == nullptr) {
      if (count == 0) alike_ = value;
      if (value == alike_) return;
    }
    if (values_ == nullptr || room() == count) spread(count, count + 1);
    const std::size_t at = rank(cells, bit);
    for (std::size_t i = count; i > at; --i) write(i, read(i - 1));
    write(at, value);
  }
  /// Takes a cell that is still set away.
  void remove(std::uint64_t cells, std::size_t bit) {
    if (values_ == nullptr) return;
    const std::size_t count = rank(cells, 64);
    for (std::size_t i = rank(cells, bit); i + 1 < count; ++i) write(i, read(i + 1));
    if (count > 1) forgetIfAlike(count - 1);
  }
  /// Bytes beside the object itself, with those of the allocator.
  std::size_t memoryBytes() const { return values_ == nullptr ? 0 : kOverhead + bytesFor(room()); }

 private:
  static constexpr std::size_t kOverhead = 8;  ///< of the allocator
  static constexpr std::size_t kStep = 16;

  /// How many cells are set below a bit.
  static std::size_t rank(std::uint64_t cells, std::size_t bit) {
    const std::uint64_t below = bit == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bit) - 1;
    return static_cast<std::size_t>(__builtin_popcountll(cells & below));
  }
  /// The room and so many values; one byte more, so that each can be read as two.
  static std::size_t bytesFor(std::size_t room) {
    return kBits == 8 ? 1 + room : 2 + (room * kBits + 7) / 8;
  }
  std::size_t room() const { return values_[0]; }
  std::uint8_t read(std::size_t i) const {
    const std::uint8_t* at = &values_[1 + i * kBits / 8];
    if (kBits == 8) return *at;
    return static_cast<std::uint8_t>((at[0] | at[1] << 8u) >> (i * kBits % 8) & kMask);
  }
  void write(std::size_t i, std::uint8_t value) {
    std::uint8_t* at = &values_[1 + i * kBits / 8];
    if (kBits == 8) {
      *at = value;
      return;
    }
    const unsigned shift = i * kBits % 8;
    const unsigned both = ((at[0] | at[1] << 8u) & ~(kMask << shift)) | unsigned{value} << shift;
    at[0] = static_cast<std::uint8_t>(both);
    at[1] = static_cast<std::uint8_t>(both >> 8u);
  }
  /// Gives each of the \p count cells a value of its own, with room for \p wanted of them and what
  /// the allocator gives away with them.
  void spread(std::size_t count, std::size_t wanted) {
    std::size_t room = wanted;
    const std::size_t taken = (bytesFor(wanted) + kOverhead + kStep - 1) / kStep * kStep;
    while (room < 64 && bytesFor(room + 1) + kOverhead <= taken) ++room;
    auto old = std::move(values_);
    values_ = std::make_unique<std::uint8_t[]>(bytesFor(room));
    if (old != nullptr) {
      std::memcpy(values_.get(), old.get(), bytesFor(old[0]));
    } else {
      for (std::size_t i = 0; i < count; ++i) write(i, alike_);
    }
    values_[0] = static_cast<std::uint8_t>(room);
  }

  void forgetIfAlike(std::size_t count) {
    const std::uint8_t first = read(0);
    for (std::size_t i = 1; i < count; ++i) {
      if (read(i) != first) return;
    }
    alike_ = first;
    values_.reset();
  }

  static constexpr unsigned kMask = (1u << kBits) - 1;

  std::unique_ptr<std::uint8_t[]> values_;  ///< room, then the values; null = all are alike
  std::uint8_t alike_ = 0;
};

/// Beliefs, which are whole steps up to kCertain (belief.h).
using BeliefValues = CellValues<5>;

}  // namespace planar_mapping::detail
