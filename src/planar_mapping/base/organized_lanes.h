// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>

#include "planar_mapping/base/simd.h"

// Vectors of 32 bytes as the compiler's own type: loops over NaN tests and 16 bit labels are not
// vectorised otherwise. Wider ones would be dealt with lane by lane where they are compared on
// machines without registers as wide. Passed by reference only, because how vectors are passed by
// value depends on the instruction set.
namespace planar_mapping::detail {

constexpr int kLanes = 8;
using FloatLanes = float __attribute__((vector_size(kLanes * sizeof(float))));
using IntLanes = std::int32_t __attribute__((vector_size(kLanes * sizeof(std::int32_t))));
constexpr int kShortLanes = 16;
using ShortLanes = std::int16_t __attribute__((vector_size(kShortLanes * sizeof(std::int16_t))));

using NarrowLanes = std::int16_t __attribute__((vector_size(kLanes * sizeof(std::int16_t))));

PLANAR_MAPPING_INLINE void load(const float* from, FloatLanes& to) {
  std::memcpy(&to, from, sizeof(to));
}

PLANAR_MAPPING_INLINE void load(const std::int16_t* from, IntLanes& to) {
  NarrowLanes narrow;
  std::memcpy(&narrow, from, sizeof(narrow));
  to = __builtin_convertvector(narrow, IntLanes);
}

PLANAR_MAPPING_INLINE void store(const IntLanes& from, std::int16_t* to) {
  const NarrowLanes narrow = __builtin_convertvector(from, NarrowLanes);
  std::memcpy(to, &narrow, sizeof(narrow));
}

/// Sum of the lanes of two vectors, in pairs.
PLANAR_MAPPING_INLINE float sumOf(const FloatLanes (&lanes)[2]) {
  const FloatLanes eight = lanes[0] + lanes[1];
  const auto four = __builtin_shufflevector(eight, eight, 0, 1, 2, 3) +
                    __builtin_shufflevector(eight, eight, 4, 5, 6, 7);
  const auto two = four + __builtin_shufflevector(four, four, 2, 3, 0, 1);
  return two[0] + two[1];
}

PLANAR_MAPPING_INLINE std::int16_t sumOf(const ShortLanes& lanes) {
  const auto eight = __builtin_shufflevector(lanes, lanes, 0, 1, 2, 3, 4, 5, 6, 7) +
                     __builtin_shufflevector(lanes, lanes, 8, 9, 10, 11, 12, 13, 14, 15);
  const auto four = eight + __builtin_shufflevector(eight, eight, 4, 5, 6, 7, 0, 1, 2, 3);
  const auto two = four + __builtin_shufflevector(four, four, 2, 3, 0, 1, 6, 7, 4, 5);
  return static_cast<std::int16_t>(two[0] + two[1]);
}

PLANAR_MAPPING_INLINE std::int16_t smallestOf(const ShortLanes& lanes) {
  const auto a = __builtin_shufflevector(lanes, lanes, 0, 1, 2, 3, 4, 5, 6, 7);
  const auto b = __builtin_shufflevector(lanes, lanes, 8, 9, 10, 11, 12, 13, 14, 15);
  const auto eight = a < b ? a : b;
  const auto other_half = __builtin_shufflevector(eight, eight, 4, 5, 6, 7, 0, 1, 2, 3);
  const auto four = eight < other_half ? eight : other_half;
  const auto other_pair = __builtin_shufflevector(four, four, 2, 3, 0, 1, 6, 7, 4, 5);
  const auto two = four < other_pair ? four : other_pair;
  return two[0] < two[1] ? two[0] : two[1];
}

}  // namespace planar_mapping::detail
