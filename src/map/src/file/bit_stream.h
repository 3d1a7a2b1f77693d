// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping::detail {

/// Labels of a tree node in the file (the paper, IV).
enum class Label : std::uint8_t { Free = 0, Occupied = 1, Unknown = 2, Inner = 3 };

/// Little-endian bytes.
class ByteWriter {
 public:
  std::vector<std::uint8_t> bytes;

  void u8(std::uint8_t v) { bytes.push_back(v); }
  void u32(std::uint32_t v) { fixed(v, 4); }
  void u64(std::uint64_t v) { fixed(v, 8); }

 private:
  void fixed(std::uint64_t v, int size) {
    for (int i = 0; i < size; ++i) u8(static_cast<std::uint8_t>(v >> (8 * i)));
  }
};

/// Little-endian bytes, varints and 2-bit labels; every function throws Error at the end of the
/// bytes.
class ByteReader {
 public:
  ByteReader(const std::uint8_t* data, std::size_t size, std::string what)
      : data_(data), size_(size), what_(std::move(what)) {}

  std::size_t left() const { return size_ - at_; }
  std::uint8_t u8() {
    if (at_ >= size_) fail("ends too early");
    return data_[at_++];
  }
  std::uint32_t u32() { return static_cast<std::uint32_t>(fixed(4)); }
  std::uint64_t u64() { return fixed(8); }
  float f32() {
    const std::uint32_t bits = u32();
    float v = 0.0f;
    std::memcpy(&v, &bits, sizeof v);
    return v;
  }
  double f64() {
    const std::uint64_t bits = fixed(8);
    double v = 0.0;
    std::memcpy(&v, &bits, sizeof v);
    return v;
  }
  std::uint64_t varint() {
    std::uint64_t v = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::uint8_t byte = u8();
      if (shift == 63 && byte > 1) break;
      v |= static_cast<std::uint64_t>(byte & 0x7fu) << shift;
      if (byte < 0x80u) return v;
    }
    fail("holds a number of more than 64 bits");
  }
  std::int64_t zigzag() {
    const std::uint64_t v = varint();
    return static_cast<std::int64_t>(v >> 1u) ^ -static_cast<std::int64_t>(v & 1u);
  }
  /// A varint that counts things of at least \p bytes each, which must still be there.
  std::size_t count(std::size_t bytes) {
    const std::uint64_t n = varint();
    if (n > left() / bytes) fail("counts more entries than it has bytes for");
    return static_cast<std::size_t>(n);
  }
  /// A zigzag varint within [low, high].
  std::int32_t within(std::int64_t low, std::int64_t high) {
    const std::int64_t v = zigzag();
    if (v < low || v > high) fail("holds a coordinate outside the world");
    return static_cast<std::int32_t>(v);
  }
  Label label() {
    if (labels_ == 0) packed_ = u8();
    const auto l = static_cast<Label>((packed_ >> (2 * labels_)) & 3u);
    labels_ = (labels_ + 1) % 4;
    return l;
  }
  void endLabels() {
    if (labels_ != 0 && (packed_ >> (2 * labels_)) != 0) fail("has bits set after its last label");
    labels_ = 0;
  }
  const std::uint8_t* take(std::size_t n) {
    if (n > left()) fail("ends too early");
    at_ += n;
    return data_ + at_ - n;
  }
  void end() const {
    if (at_ != size_) fail("has bytes left over");
  }
  [[noreturn]] void fail(const std::string& problem) const { throw Error(what_ + " " + problem); }

 private:
  std::uint64_t fixed(int size) {
    std::uint64_t v = 0;
    for (int i = 0; i < size; ++i) v |= static_cast<std::uint64_t>(u8()) << (8 * i);
    return v;
  }

  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
  std::string what_;
  int labels_ = 0;
  unsigned packed_ = 0;
};

}  // namespace planar_mapping::detail
