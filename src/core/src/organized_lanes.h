// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>

// Vectors of 16 lanes as the compiler's own type: it splits them to whatever the instruction set
// of the clone has. Loops over NaN tests and 16 bit labels are not vectorised otherwise. Passed by
// reference only, because how vectors are passed by value depends on the instruction set.
namespace planar_mapping::detail {

constexpr int kLanes = 16;
using FloatLanes = float __attribute__((vector_size(kLanes * sizeof(float))));
using IntLanes = std::int32_t __attribute__((vector_size(kLanes * sizeof(std::int32_t))));
using ShortLanes = std::int16_t __attribute__((vector_size(kLanes * sizeof(std::int16_t))));

#define PLANAR_MAPPING_INLINE inline __attribute__((always_inline))

PLANAR_MAPPING_INLINE void load(const float* from, FloatLanes& to) {
  std::memcpy(&to, from, sizeof(to));
}

PLANAR_MAPPING_INLINE void load(const std::int16_t* from, IntLanes& to) {
  ShortLanes narrow;
  std::memcpy(&narrow, from, sizeof(narrow));
  to = __builtin_convertvector(narrow, IntLanes);
}

PLANAR_MAPPING_INLINE void store(const IntLanes& from, std::int16_t* to) {
  const ShortLanes narrow = __builtin_convertvector(from, ShortLanes);
  std::memcpy(to, &narrow, sizeof(narrow));
}

/// Sum of the lanes, in pairs.
PLANAR_MAPPING_INLINE float sumOf(const FloatLanes& lanes) {
  float values[kLanes];
  std::memcpy(values, &lanes, sizeof(values));
  for (int half = kLanes / 2; half > 0; half /= 2) {
    for (int lane = 0; lane < half; ++lane) values[lane] += values[lane + half];
  }
  return values[0];
}

}  // namespace planar_mapping::detail
