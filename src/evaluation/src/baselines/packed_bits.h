// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace planar_mapping {
namespace evaluation {

/// Bits it takes to tell \p values different values apart.
inline int bitsFor(double values) {
  return values <= 1.0 ? 0 : static_cast<int>(std::ceil(std::log2(values)));
}

inline std::size_t bytesOfBits(std::size_t count, int bits) {
  return (count * static_cast<std::size_t>(bits) + 7) / 8;
}

}  // namespace evaluation
}  // namespace planar_mapping
