// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <vector>

#include "store/heap_bytes.h"

namespace planar_mapping::detail {

/// Bytes that are written once and then read, without room to spare: a pointer to one block.
class PackedBytes {
 public:
  PackedBytes() = default;
  explicit PackedBytes(const std::vector<std::uint8_t>& bytes)
      : PackedBytes(bytes.data(), bytes.size()) {}
  PackedBytes(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return;
    if (size > UINT32_MAX) throw std::bad_alloc();
    block_.reset(new std::uint8_t[kHead + size]);  // not cleared first
    const auto head = static_cast<std::uint32_t>(size);
    std::memcpy(block_.get(), &head, sizeof head);
    std::memcpy(block_.get() + kHead, data, size);
  }
  PackedBytes(const PackedBytes& other) : PackedBytes(other.data(), other.size()) {}
  PackedBytes(PackedBytes&& other) noexcept = default;
  PackedBytes& operator=(const PackedBytes& other) {
    if (this != &other) *this = PackedBytes(other);
    return *this;
  }
  PackedBytes& operator=(PackedBytes&& other) noexcept = default;

  bool empty() const { return block_ == nullptr; }
  std::size_t size() const {
    std::uint32_t size = 0;
    if (!empty()) std::memcpy(&size, block_.get(), sizeof size);
    return size;
  }
  const std::uint8_t* data() const { return empty() ? nullptr : block_.get() + kHead; }
  std::uint8_t* data() { return empty() ? nullptr : block_.get() + kHead; }
  /// On the heap.
  std::size_t memoryBytes() const { return empty() ? 0 : heapBytes(kHead + size()); }

 private:
  static constexpr std::size_t kHead = sizeof(std::uint32_t);

  std::unique_ptr<std::uint8_t[]> block_;  ///< the size, then the bytes
};

}  // namespace planar_mapping::detail
