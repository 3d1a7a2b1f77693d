// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace planar_mapping::detail {

/// Copies the indices whose mark (0 or 1) is the wanted one. Neighbours mostly have the same mark,
/// so eight are compared at a time; the others are copied without a branch.
/// \param to room for one more than are wanted; may be where the indices are
/// \return one past the last that was copied
inline int* copyMarked(const int* indices, const std::uint8_t* marks, std::size_t n,
                       std::uint8_t wanted, int* to) {
  constexpr std::size_t kTogether = 8;
  constexpr std::uint64_t kOnes = 0x0101010101010101u;
  const std::uint64_t all = kOnes * wanted;
  std::size_t i = 0;
  for (; i + kTogether <= n; i += kTogether) {
    std::uint64_t eight;
    std::memcpy(&eight, marks + i, sizeof(eight));
    if (eight == all) {
      int together[kTogether];  // all are read before any is written, and no function is called
      std::memcpy(together, indices + i, sizeof(together));
      std::memcpy(to, together, sizeof(together));
      to += kTogether;
    } else if (eight != (all ^ kOnes)) {
      for (std::size_t k = i; k < i + kTogether; ++k) {
        *to = indices[k];
        to += marks[k] == wanted ? 1 : 0;
      }
    }
  }
  for (; i < n; ++i) {
    *to = indices[i];
    to += marks[i] == wanted ? 1 : 0;
  }
  return to;
}

}  // namespace planar_mapping::detail
