// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

namespace planar_mapping::detail {

/// A value that most maps have no need of: a pointer, null if there is none. Copied with its owner.
template <typename T>
struct HeapValue : std::unique_ptr<T> {
  using std::unique_ptr<T>::unique_ptr;

  HeapValue() = default;
  HeapValue(const HeapValue& other)
      : std::unique_ptr<T>(other ? std::make_unique<T>(*other) : nullptr) {}
  HeapValue(HeapValue&&) noexcept = default;
  HeapValue& operator=(const HeapValue& other) {
    if (this != &other) *this = HeapValue(other);
    return *this;
  }
  HeapValue& operator=(HeapValue&&) noexcept = default;
};

}  // namespace planar_mapping::detail
