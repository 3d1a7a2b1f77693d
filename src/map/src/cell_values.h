// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>

namespace planar_mapping::detail {

/// A byte for each cell of a bundle of 64 that is set, in the order of their bits. Costs eight
/// bytes as long as all are alike, as most are.
///
/// The set cells are kept by the caller, who hands them over; positions are bits that are set.
class CellValues {
 public:
  CellValues() = default;
  CellValues(const CellValues& other) : alike_(other.alike_) {
    if (other.values_ == nullptr) return;
    const std::size_t room = other.values_[0];
    values_ = std::make_unique<std::uint8_t[]>(1 + room);
    std::memcpy(values_.get(), other.values_.get(), 1 + room);
  }
  CellValues(CellValues&& other) noexcept = default;
  CellValues& operator=(const CellValues& other) {
    if (this != &other) *this = CellValues(other);
    return *this;
  }
  CellValues& operator=(CellValues&& other) noexcept = default;

  std::uint8_t get(std::uint64_t cells, std::size_t bit) const {
    return values_ == nullptr ? alike_ : values_[1 + rank(cells, bit)];
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
      spread(count);
    }
    values_[1 + rank(cells, bit)] = value;
  }
  /// Makes room for a cell that is not set yet.
  void insert(std::uint64_t cells, std::size_t bit, std::uint8_t value) {
    const std::size_t count = rank(cells, 64);
    if (values_ == nullptr) {
      if (count == 0) alike_ = value;
      if (value == alike_) return;
    }
    if (values_ == nullptr || values_[0] == count) spread(count + 1);
    std::uint8_t* at = values_.get() + 1 + rank(cells, bit);
    std::memmove(at + 1, at, 1 + count - static_cast<std::size_t>(at - values_.get()));
    *at = value;
  }
  /// Takes a cell that is still set away.
  void remove(std::uint64_t cells, std::size_t bit) {
    if (values_ == nullptr) return;
    const std::size_t count = rank(cells, 64);
    std::uint8_t* at = values_.get() + 1 + rank(cells, bit);
    std::memmove(at, at + 1, count - static_cast<std::size_t>(at - values_.get()));
  }
  /// Bytes beside the object itself, with those of the allocator.
  std::size_t memoryBytes() const {
    constexpr std::size_t kOverhead = 8;
    return values_ == nullptr ? 0 : kOverhead + 1 + values_[0];
  }

 private:
  static constexpr std::size_t kStep = 16;  ///< of the allocator

  /// How many cells are set below a bit.
  static std::size_t rank(std::uint64_t cells, std::size_t bit) {
    const std::uint64_t below = bit == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bit) - 1;
    return static_cast<std::size_t>(__builtin_popcountll(cells & below));
  }
  /// Gives every cell a byte of its own, with room for \p count of them.
  void spread(std::size_t count) {
    const std::size_t room = (count + 9 + kStep - 1) / kStep * kStep - 9;
    auto values = std::make_unique<std::uint8_t[]>(1 + room);
    std::memset(values.get(), alike_, 1 + room);
    if (values_ != nullptr) std::memcpy(values.get() + 1, values_.get() + 1, values_[0]);
    values[0] = static_cast<std::uint8_t>(room);
    values_ = std::move(values);
  }

  std::unique_ptr<std::uint8_t[]> values_;  ///< room, then the values; null = all are alike
  std::uint8_t alike_ = 0;
};

}  // namespace planar_mapping::detail
