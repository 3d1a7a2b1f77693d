// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace planar_mapping::tools {

/// Bytes that this process has taken from malloc and not given back.
std::size_t heapInUse();

/// Bytes that a copy of \p original takes of the heap, rounding of malloc included. Means nothing
/// while other threads are at work.
template <typename T>
double heapBytesOfCopy(const T& original) {
  const std::size_t before = heapInUse();
  const T copy(original);
  return static_cast<double>(heapInUse() - before);
}

}  // namespace planar_mapping::tools
