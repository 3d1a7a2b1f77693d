// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace planar_mapping::detail {

/// The bytes of a section of a map file: columns of numbers (docs/file_format.md). One description
/// of a section writes and reads it. Reading never allocates for more than there are bytes.
class Columns {
 public:
  /// Writes a section.
  explicit Columns(std::string section) : section_(std::move(section)) {}
  /// Reads a section.
  Columns(std::string section, const std::uint8_t* data, std::size_t size)
      : section_(std::move(section)), is_reading_(true), data_(data), size_(size) {}

  bool isReading() const { return is_reading_; }
  const std::vector<std::uint8_t>& written() const { return written_; }

  /// One number.
  template <typename T>
  void value(T& value) {
    std::vector<T> one(1, value);
    column(one);
    value = one[0];
  }
  /// The number of items; resizes them when reading.
  /// \param bytes that each item takes at least in what follows
  template <typename Item>
  void size(std::vector<Item>& items, std::size_t bytes) {
    std::uint64_t n = items.size();
    value(n);
    if (!is_reading_) return;
    if (n > left() / bytes) fail("counts more entries than it has bytes for");
    items.resize(static_cast<std::size_t>(n));
  }
  /// One number of each item: all lowest bytes, then all second ones, ... \p get returns a
  /// reference to the number.
  template <typename Item, typename Get>
  void column(std::vector<Item>& items, Get&& get) {
    using T = std::decay_t<decltype(get(items.front()))>;
    const std::size_t n = items.size();
    if (!is_reading_) {
      const std::size_t start = written_.size();
      written_.resize(start + n * sizeof(T));
      for (std::size_t i = 0; i < n; ++i) {
        WordOf<T> word = 0;
        std::memcpy(&word, &get(items[i]), sizeof(T));
        for (std::size_t b = 0; b < sizeof(T); ++b) {
          written_[start + b * n + i] = static_cast<std::uint8_t>(word >> (8 * b));
        }
      }
      return;
    }
    if (n > left() / sizeof(T)) fail("ends too early");
    const std::uint8_t* bytes = take(n * sizeof(T));
    for (std::size_t i = 0; i < n; ++i) {
      WordOf<T> word = 0;
      for (std::size_t b = 0; b < sizeof(T); ++b) {
        word = static_cast<WordOf<T>>(word | WordOf<T>{bytes[b * n + i]} << (8 * b));
      }
      std::memcpy(&get(items[i]), &word, sizeof(T));
    }
  }
  template <typename T>
  void column(std::vector<T>& values) {
    column(values, [](T& value) -> T& { return value; });
  }
  /// \p count labels of two bits, four a byte, the first in the lowest bits.
  void labels(std::vector<std::uint8_t>& labels, std::size_t count);
  /// All bytes that are left.
  void text(std::string& text);

  std::size_t left() const { return size_ - at_; }
  /// \throws Error if bytes are left
  void end() const;
  /// \throws Error that names the section
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  /// What has the bits of a number.
  template <typename T>
  using WordOf = std::conditional_t<
      sizeof(T) == 8, std::uint64_t,
      std::conditional_t<sizeof(T) == 4, std::uint32_t,
                         std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>>;
  /// The place of the next bytes. \throws Error if there are fewer
  const std::uint8_t* take(std::size_t bytes);

  std::string section_;
  bool is_reading_ = false;
  std::vector<std::uint8_t> written_;
  const std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
  std::size_t at_ = 0;
};

}  // namespace planar_mapping::detail
