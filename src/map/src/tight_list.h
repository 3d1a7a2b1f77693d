// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <type_traits>
#include <vector>

namespace planar_mapping::detail {

/// A list that is made once and then read, without room to spare: eight bytes while it is empty, as
/// most of those a map keeps of each of its planes are.
template <typename T>
class TightList {
  static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= alignof(std::size_t));

 public:
  TightList() = default;
  TightList(const std::vector<T>& values) {  // NOLINT: stands for the vector
    if (values.empty()) return;
    block_ = std::make_unique<std::byte[]>(kHead + values.size() * sizeof(T));
    *reinterpret_cast<std::size_t*>(block_.get()) = values.size();
    std::copy(values.begin(), values.end(), begin());
  }

  std::size_t size() const {
    return block_ == nullptr ? 0 : *reinterpret_cast<const std::size_t*>(block_.get());
  }
  T* begin() { return reinterpret_cast<T*>(block_.get() + (block_ == nullptr ? 0 : kHead)); }
  T* end() { return begin() + size(); }
  const T* begin() const { return const_cast<TightList*>(this)->begin(); }
  const T* end() const { return begin() + size(); }
  T& operator[](std::size_t i) { return begin()[i]; }
  const T& operator[](std::size_t i) const { return begin()[i]; }
  /// Beside the list itself.
  std::size_t memoryBytes() const { return block_ == nullptr ? 0 : kHead + size() * sizeof(T); }

 private:
  static constexpr std::size_t kHead = sizeof(std::size_t);
  std::unique_ptr<std::byte[]> block_;
};

}  // namespace planar_mapping::detail
