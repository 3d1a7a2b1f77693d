// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace planar_mapping::detail {

/// Points as one array per coordinate.
/// \param stride  floats from point to point, at least 3
/// \param indices of the points; null = the first \p n
inline void gatherPoints(const float* points, std::size_t stride, const int* indices, std::size_t n,
                         float* x, float* y, float* z) {
  constexpr std::size_t kAhead = 512;  // points
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = indices != nullptr ? static_cast<std::size_t>(indices[k]) : k;
    const float* point = points + i * stride;
    // What the processor fetches by itself ends with each page: ask for what comes later.
    __builtin_prefetch(point + kAhead * stride);
    x[k] = point[0];
    y[k] = point[1];
    z[k] = point[2];
  }
}

}  // namespace planar_mapping::detail
