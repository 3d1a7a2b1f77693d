// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace planar_mapping::detail {

// Numbers in few bytes, for what a live map keeps: seven bits a byte, the last one below 128. What
// is read was written by this process; files have readers of their own, which trust nothing.

/// A number with its sign in the lowest bit: small ones are short, whatever their sign.
constexpr std::uint64_t foldSign(std::uint64_t number) {
  return (number << 1u) ^ ((number >> 63u) != 0 ? ~std::uint64_t{0} : 0);
}
constexpr std::uint64_t unfoldSign(std::uint64_t folded) {
  return (folded >> 1u) ^ ((folded & 1u) != 0 ? ~std::uint64_t{0} : 0);
}

/// Adds numbers to bytes.
class PackWriter {
 public:
  std::vector<std::uint8_t> bytes;

  void byte(unsigned value) { bytes.push_back(static_cast<std::uint8_t>(value)); }
  void number(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7u) byte(static_cast<unsigned>(0x80u | (value & 0x7fu)));
    byte(static_cast<unsigned>(value));
  }
  void difference(std::int64_t value) { number(foldSign(static_cast<std::uint64_t>(value))); }
  template <typename T>
  void raw(const T& value) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof value);
    std::memcpy(&bytes[at], &value, sizeof value);
  }
  void append(const std::uint8_t* data, std::size_t size) {
    bytes.insert(bytes.end(), data, data + size);
  }
};

/// Reads what a PackWriter wrote.
class PackReader {
 public:
  explicit PackReader(const std::uint8_t* data) : at_(data) {}

  const std::uint8_t* at() const { return at_; }
  void skip(std::size_t bytes) { at_ += bytes; }
  std::uint8_t byte() { return *at_++; }
  std::uint64_t number() {
    std::uint64_t number = 0;
    for (unsigned shift = 0;; shift += 7) {
      const std::uint8_t next = *at_++;
      number |= std::uint64_t{next & 0x7fu} << shift;
      if (next < 0x80) return number;
    }
  }
  std::int64_t difference() { return static_cast<std::int64_t>(unfoldSign(number())); }
  /// The same for numbers known to fit.
  template <typename T>
  T as() {
    return static_cast<T>(number());
  }
  template <typename T>
  T differenceAs() {
    return static_cast<T>(difference());
  }
  template <typename T>
  T raw() {
    T value;
    std::memcpy(&value, at_, sizeof value);
    at_ += sizeof value;
    return value;
  }

 private:
  const std::uint8_t* at_;
};

// The same in bits, for records that are so small that bytes are too much for most of their
// numbers. A number takes k + 1 bits if it is below 2^k, about two more each time it doubles; which
// k does best depends on what it means.

/// Adds numbers to bytes, from the next byte on.
class BitWriter {
 public:
  explicit BitWriter(PackWriter& out) : out_(out) {}

  /// The lowest \p count bits, of at most 64.
  void bits(std::uint64_t value, unsigned count) {
    while (count > 0) {
      if (free_ == 0) {
        out_.byte(0);
        free_ = 8;
      }
      const unsigned taken = std::min(count, free_);
      const auto part = static_cast<unsigned>(value & ((1u << taken) - 1u));
      std::uint8_t& last = out_.bytes.back();
      last = static_cast<std::uint8_t>(last | part << (8 - free_));
      value >>= taken;
      free_ -= taken;
      count -= taken;
    }
  }
  void number(std::uint64_t value, unsigned k) {
    const std::uint64_t high = value >> k;
    const unsigned length = high == 0 ? 0 : 64 - static_cast<unsigned>(__builtin_clzll(high));
    bits(0, length);
    bits(1, 1);
    if (length > 1) bits(high, length - 1);  // the highest bit is known
    bits(value, k);
  }
  void difference(std::int64_t value, unsigned k) {
    number(foldSign(static_cast<std::uint64_t>(value)), k);
  }

 private:
  PackWriter& out_;
  unsigned free_ = 0;  ///< bits of the last byte
};

/// Reads what a BitWriter wrote.
class BitReader {
 public:
  explicit BitReader(PackReader& in) : in_(in) {}

  std::uint64_t bits(unsigned count) {
    std::uint64_t value = 0;
    for (unsigned have = 0; have < count;) {
      if (left_ == 0) {
        byte_ = in_.byte();
        left_ = 8;
      }
      const unsigned taken = std::min(count - have, left_);
      value |= std::uint64_t{byte_ & ((1u << taken) - 1u)} << have;
      byte_ >>= taken;
      left_ -= taken;
      have += taken;
    }
    return value;
  }
  std::uint64_t number(unsigned k) {
    unsigned length = 0;
    while (bits(1) == 0) ++length;
    std::uint64_t high = length == 0 ? 0 : std::uint64_t{1} << (length - 1);
    if (length > 1) high |= bits(length - 1);
    return high << k | bits(k);
  }
  std::int64_t difference(unsigned k) { return static_cast<std::int64_t>(unfoldSign(number(k))); }
  /// The same for numbers known to fit.
  template <typename T>
  T as(unsigned k) {
    return static_cast<T>(number(k));
  }
  template <typename T>
  T differenceAs(unsigned k) {
    return static_cast<T>(difference(k));
  }

 private:
  PackReader& in_;
  unsigned byte_ = 0;  ///< what is left of the last byte
  unsigned left_ = 0;  ///< how many bits that is
};

}  // namespace planar_mapping::detail
