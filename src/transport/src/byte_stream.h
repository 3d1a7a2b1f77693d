// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::transport {

/// The peer broke the protocol: damaged, cut, too long, contradictory or out of turn.
class ProtocolError : public InputError {
 public:
  using InputError::InputError;
};

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kMaxText = 1024;  ///< bytes of one text; longer ones are cut
static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers travel little-endian");

// ByteWriter and ByteReader have the same functions, so that one template lists the fields of a
// message for both directions.
class ByteWriter {
 public:
  Bytes bytes;

  template <typename Number>
  void number(const Number& value, const char* /*field*/) {
    static_assert(std::is_arithmetic_v<Number>);
    put(&value, sizeof(value));
  }
  void size(std::size_t value, const char* field) { number(std::uint64_t{value}, field); }
  template <typename Enumeration>
  void enumeration(Enumeration value, Enumeration /*last*/, const char* field) {
    number(static_cast<std::uint8_t>(value), field);
  }
  void text(const std::string& value, const char* field, std::size_t max_size = kMaxText,
            bool /*raw*/ = false) {
    const std::size_t size = std::min(value.size(), max_size);
    number(static_cast<std::uint32_t>(size), field);
    put(value.data(), size);
  }
  template <typename Items>
  void resize(const Items& items, const char* field, std::size_t /*item_bytes*/,
              std::size_t max_count) {
    if (items.size() > max_count) throw InputError(std::string("too many ") + field);
    number(static_cast<std::uint32_t>(items.size()), field);
  }
  template <typename Value>
  bool optional(const std::optional<Value>& value, const char* field) {
    number(value.has_value(), field);
    return value.has_value();
  }
  void put(const void* data, std::size_t size) {
    const auto* first = static_cast<const std::uint8_t*>(data);
    bytes.insert(bytes.end(), first, first + size);
  }
};

/// Trusts nothing. \throws ProtocolError naming the field
class ByteReader {
 public:
  ByteReader(const void* data, std::size_t size)
      : data_(static_cast<const std::uint8_t*>(data)), end_(data_ + size) {}

  template <typename Number>
  void number(Number& value, const char* field) {
    static_assert(std::is_arithmetic_v<Number>);
    const std::uint8_t* bytes = take(sizeof(value), field);
    if (std::is_same_v<Number, bool> && *bytes > 1) fail(field, "is neither 0 nor 1");
    std::memcpy(&value, bytes, sizeof(value));
  }
  void size(std::size_t& value, const char* field) {
    std::uint64_t read = 0;
    number(read, field);
    value = static_cast<std::size_t>(read);
  }
  template <typename Enumeration>
  void enumeration(Enumeration& value, Enumeration last, const char* field) {
    std::uint8_t read = 0;
    number(read, field);
    if (read > static_cast<std::uint8_t>(last)) fail(field, "has an unknown value");
    value = static_cast<Enumeration>(read);
  }
  /// One line of printable ASCII, unless \p raw: what could disturb a terminal becomes '?'.
  void text(std::string& value, const char* field, std::size_t max_size = kMaxText,
            bool raw = false) {
    const std::size_t size = count(field, 1, max_size);
    value.assign(reinterpret_cast<const char*>(take(size, field)), size);
    const auto is_other = [](char c) { return c < ' ' || c > '~'; };
    if (!raw) std::replace_if(value.begin(), value.end(), is_other, '?');
  }
  /// Takes no memory that was not sent.
  template <typename Items>
  void resize(Items& items, const char* field, std::size_t item_bytes, std::size_t max_count) {
    items.resize(count(field, item_bytes, max_count));
  }
  template <typename Value>
  bool optional(std::optional<Value>& value, const char* field) {
    bool has_value = false;
    number(has_value, field);
    if (has_value) value.emplace();
    return has_value;
  }
  const std::uint8_t* take(std::size_t size, const char* field) {
    if (size > left()) fail(field, "is cut");
    return std::exchange(data_, data_ + size);
  }
  std::size_t left() const { return static_cast<std::size_t>(end_ - data_); }
  void expectEnd() const {
    if (left() > 0) throw ProtocolError(std::to_string(left()) + " bytes follow the last field");
  }
  [[noreturn]] static void fail(const char* field, const std::string& problem) {
    throw ProtocolError(std::string("field '") + field + "' " + problem);
  }

 private:
  std::size_t count(const char* field, std::size_t item_bytes, std::size_t max_count) {
    std::uint32_t count = 0;
    number(count, field);
    if (count > max_count || count > left() / item_bytes) fail(field, "has too many items");
    return count;
  }

  const std::uint8_t* data_;
  const std::uint8_t* end_;
};

}  // namespace planar_mapping::transport
