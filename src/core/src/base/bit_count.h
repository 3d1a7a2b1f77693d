// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace planar_mapping::detail {

/// Bits that are on. Without an instruction for it the compiler calls a function of its library
/// that looks up tables, which takes several times as long.
inline std::size_t bitCount(std::uint64_t bits) {
#ifdef __POPCNT__
  return static_cast<std::size_t>(__builtin_popcountll(bits));
#else
  bits -= bits >> 1u & 0x5555555555555555u;
  bits = (bits & 0x3333333333333333u) + (bits >> 2u & 0x3333333333333333u);
  bits = (bits + (bits >> 4u)) & 0x0f0f0f0f0f0f0f0fu;
  return static_cast<std::size_t>(bits * 0x0101010101010101u >> 56u);
#endif
}

}  // namespace planar_mapping::detail
