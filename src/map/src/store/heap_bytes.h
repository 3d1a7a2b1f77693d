// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace planar_mapping::detail {

/// What a block of so many bytes takes of the heap: glibc's malloc puts eight bytes in front and
/// deals in sixteens, 32 at least. Maps are made of small blocks: without that their memory would
/// be told too small.
constexpr std::size_t heapBytes(std::size_t bytes) {
  constexpr std::size_t kHead = 8;
  constexpr std::size_t kStep = 16;
  return bytes == 0 ? 0 : std::max<std::size_t>(32, (bytes + kHead + kStep - 1) / kStep * kStep);
}
/// Of a vector, beside the vector itself and what its elements hold.
template <typename T>
std::size_t heapBytes(const std::vector<T>& values) {
  return heapBytes(values.capacity() * sizeof(T));
}

}  // namespace planar_mapping::detail
