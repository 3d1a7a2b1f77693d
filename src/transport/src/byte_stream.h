// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <type_traits>

#include "planar_mapping/transport/message.h"

namespace planar_mapping::transport::detail {

/// Little-endian, whatever the machine is.
class ByteWriter {
 public:
  explicit ByteWriter(Bytes& bytes) : bytes_(bytes) {}

  template <typename Integer>
  void integer(Integer value) {
    static_assert(std::is_unsigned_v<Integer>, "signed values travel as two's complement");
    for (std::size_t i = 0; i < sizeof(value); ++i) {
      bytes_.push_back(static_cast<std::uint8_t>(value >> (8U * i)));
    }
  }
  void boolean(bool value) { integer(static_cast<std::uint8_t>(value ? 1 : 0)); }
  void real(float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    integer(bits);
  }
  void real(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    integer(bits);
  }
  /// Cut at kLargestText unless told otherwise.
  void text(const std::string& value, std::size_t largest = kLargestText) {
    const std::size_t size = std::min(value.size(), largest);
    integer(static_cast<std::uint32_t>(size));
    bytes_.insert(bytes_.end(), value.begin(), value.begin() + static_cast<std::ptrdiff_t>(size));
  }

 private:
  Bytes& bytes_;
};

/// Reads what ByteWriter wrote, and trusts nothing. Messages name the field.
class ByteReader {
 public:
  ByteReader(const std::uint8_t* data, std::size_t size) : data_(data), end_(data + size) {}
  explicit ByteReader(const Bytes& bytes) : ByteReader(bytes.data(), bytes.size()) {}

  template <typename Integer>
  Integer integer(const char* field) {
    static_assert(std::is_unsigned_v<Integer>, "signed values travel as two's complement");
    const std::uint8_t* bytes = take(sizeof(Integer), field);
    Integer value = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) {
      value = static_cast<Integer>(value | (static_cast<Integer>(bytes[i]) << (8U * i)));
    }
    return value;
  }
  bool boolean(const char* field) {
    const auto value = integer<std::uint8_t>(field);
    if (value > 1) throw ProtocolError(std::string("field '") + field + "' is neither 0 nor 1");
    return value == 1;
  }
  float real32(const char* field) {
    const auto bits = integer<std::uint32_t>(field);
    float value = 0.0F;
    std::memcpy(&value, &bits, sizeof(value));
    return value;
  }
  double real64(const char* field) {
    const auto bits = integer<std::uint64_t>(field);
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof(value));
    return value;
  }
  std::string text(const char* field, std::size_t largest = kLargestText) {
    const std::size_t size = count(field, 1, largest);
    const std::uint8_t* bytes = take(size, field);
    return {reinterpret_cast<const char*>(bytes), size};
  }
  /// Number of items that follow, each of at least \p item_bytes, so that nobody makes us allocate
  /// more than was sent.
  std::size_t count(const char* field, std::size_t item_bytes, std::size_t largest) {
    const auto value = std::size_t{integer<std::uint32_t>(field)};
    if (value > largest || value > left() / item_bytes) {
      throw ProtocolError(std::string("field '") + field + "' announces " + std::to_string(value) +
                          " items, more than there are");
    }
    return value;
  }
  const std::uint8_t* take(std::size_t size, const char* field) {
    if (size > left()) throw ProtocolError(std::string("it ends within field '") + field + "'");
    const std::uint8_t* bytes = data_;
    data_ += size;
    return bytes;
  }
  std::size_t left() const { return static_cast<std::size_t>(end_ - data_); }
  void expectEnd() const {
    if (left() > 0) throw ProtocolError(std::to_string(left()) + " bytes follow its last field");
  }

 private:
  const std::uint8_t* data_;
  const std::uint8_t* end_;
};

}  // namespace planar_mapping::transport::detail
