// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

}  // namespace planar_mapping::detail
