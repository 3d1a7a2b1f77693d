// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "planar_mapping/core/base/detail/simd.h"

// May be called from functions that exist for several instruction sets (core/simd.h).
namespace planar_mapping::detail {

/// Lists the positions whose mark is 1, not 0, ascending. Neighbours mostly share their mark, so
/// that eight are looked at together; which of the others are marked no branch could foresee.
/// \param first number of the first position
/// \param to    room for one more than are marked
/// \return one past the last that was listed
template <typename Number>
PLANAR_MAPPING_INLINE Number* listMarked(const std::uint8_t* marks, std::size_t n, Number first,
                                         Number* to) {
  constexpr std::size_t kTogether = 8;
  constexpr std::uint64_t kAll = 0x0101010101010101u;
  const auto look = [&](std::size_t i) {  // written always, kept sometimes
    *to = static_cast<Number>(first + i);
    to += marks[i];
  };
  std::size_t i = 0;
  for (; i + kTogether <= n; i += kTogether) {
    std::uint64_t eight;
    std::memcpy(&eight, marks + i, sizeof(eight));
    if (eight == 0) continue;
    if (eight == kAll) {
      for (std::size_t k = 0; k < kTogether; ++k) to[k] = static_cast<Number>(first + i + k);
      to += kTogether;
    } else {
      for (std::size_t k = i; k < i + kTogether; ++k) look(k);
    }
  }
  for (; i < n; ++i) look(i);
  return to;
}

}  // namespace planar_mapping::detail
