// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace planar_mapping::detail {

/// Asks for the points that come a page later: what the processor fetches by itself ends with each
/// page, and a pass over a cloud larger than its caches would wait there. A hint, never an access.
inline __attribute__((always_inline)) void fetchAhead(const float* point, std::size_t stride) {
  constexpr std::size_t kPoints = 256;
  __builtin_prefetch(point + kPoints * stride);
}

}  // namespace planar_mapping::detail
