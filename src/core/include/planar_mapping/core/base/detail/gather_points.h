// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstring>

#include "planar_mapping/core/base/detail/simd.h"

// To be called from functions that exist for several instruction sets (core/simd.h).
namespace planar_mapping::detail {

using FourFloats = float __attribute__((vector_size(16)));

/// Asks for a point that will be read, into the second cache. A hint, never an access.
PLANAR_MAPPING_INLINE void fetch(const float* point) {
  constexpr int kToRead = 0;
  constexpr int kSecondCache = 2;
  __builtin_prefetch(point, kToRead, kSecondCache);
}

/// Asks for the points that come two pages later: what the processor fetches by itself ends with
/// each page, and a pass over a cloud larger than its caches would wait there.
PLANAR_MAPPING_INLINE void fetchAhead(const float* point, std::size_t stride) {
  constexpr std::size_t kPoints = 512;
  fetch(point + kPoints * stride);
}

/// Four points of a cloud, one vector per coordinate.
/// \param one, two, three are read together with the float behind them, \p four with the float
///        before it
PLANAR_MAPPING_INLINE void readFour(const float* one, const float* two, const float* three,
                                    const float* four, FourFloats& x, FourFloats& y,
                                    FourFloats& z) {
  FourFloats a, b, c, d;
  std::memcpy(&a, one, sizeof(a));
  std::memcpy(&b, two, sizeof(b));
  std::memcpy(&c, three, sizeof(c));
  std::memcpy(&d, four - 1, sizeof(d));
  const FourFloats ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const FourFloats cd = __builtin_shufflevector(c, d, 0, 5, 1, 6);
  const FourFloats ab_z = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const FourFloats cd_z = __builtin_shufflevector(c, d, 2, 7, 3, 4);
  x = __builtin_shufflevector(ab, cd, 0, 1, 4, 5);
  y = __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
  z = __builtin_shufflevector(ab_z, cd_z, 0, 1, 4, 5);
}

/// Four points side by side.
/// \param kStride floats from point to point, at least 4; behind the last point nothing is read
template <std::size_t kStride>
PLANAR_MAPPING_INLINE void readFour(const float* points, FourFloats& x, FourFloats& y,
                                    FourFloats& z) {
  static_assert(kStride >= 4, "a point is read together with the float behind it");
  readFour(points, points + kStride, points + 2 * kStride, points + 3 * kStride, x, y, z);
}

/// The same, three floats from point to point.
template <>
PLANAR_MAPPING_INLINE void readFour<3>(const float* points, FourFloats& x, FourFloats& y,
                                       FourFloats& z) {
  FourFloats a, b, c;
  std::memcpy(&a, points, sizeof(a));
  std::memcpy(&b, points + 4, sizeof(b));
  std::memcpy(&c, points + 8, sizeof(c));
  x = __builtin_shufflevector(__builtin_shufflevector(a, b, 0, 3, 6, 6), c, 0, 1, 2, 5);
  y = __builtin_shufflevector(__builtin_shufflevector(a, b, 1, 4, 7, 7), c, 0, 1, 2, 6);
  z = __builtin_shufflevector(a, __builtin_shufflevector(b, c, 1, 4, 7, 7), 2, 4, 5, 6);
}

/// The same for any stride.
PLANAR_MAPPING_INLINE void readFour(const float* points, std::size_t stride, FourFloats& x,
                                    FourFloats& y, FourFloats& z) {
  if (stride == 4) return readFour<4>(points, x, y, z);
  if (stride == 3) return readFour<3>(points, x, y, z);
  if (stride == 8) return readFour<8>(points, x, y, z);
  const float* second = points + stride;
  const float* third = second + stride;
  const float* fourth = third + stride;
  x = FourFloats{points[0], second[0], third[0], fourth[0]};
  y = FourFloats{points[1], second[1], third[1], fourth[1]};
  z = FourFloats{points[2], second[2], third[2], fourth[2]};
}

PLANAR_MAPPING_INLINE void store(const FourFloats& from, float* to) {
  std::memcpy(to, &from, sizeof(from));
}

/// The same into arrays.
PLANAR_MAPPING_INLINE void readFour(const float* points, std::size_t stride, float* x, float* y,
                                    float* z) {
  FourFloats in_x, in_y, in_z;
  readFour(points, stride, in_x, in_y, in_z);
  store(in_x, x);
  store(in_y, y);
  store(in_z, z);
}

PLANAR_MAPPING_INLINE void readOne(const float* point, float* x, float* y, float* z) {
  *x = point[0];
  *y = point[1];
  *z = point[2];
}

/// The points at the indices, one array per coordinate. Indices mostly ascend: then four points at
/// a time are turned into coordinates, and none is read beyond its neighbours in the cloud.
/// \param stride floats from point to point, at least 3
PLANAR_MAPPING_INLINE void gatherPoints(const float* points, std::size_t stride, const int* indices,
                                        std::size_t n, float* x, float* y, float* z) {
  const auto at = [&](std::size_t k) {
    return points + static_cast<std::size_t>(indices[k]) * stride;
  };
  std::size_t k = 0;
  for (; k + 4 <= n; k += 4) {
    const int* i = indices + k;
    fetchAhead(at(k), stride);
    if ((i[0] < i[1]) & (i[1] < i[2]) & (i[2] < i[3])) {
      FourFloats in_x, in_y, in_z;
      readFour(at(k), at(k + 1), at(k + 2), at(k + 3), in_x, in_y, in_z);
      store(in_x, x + k);
      store(in_y, y + k);
      store(in_z, z + k);
      continue;
    }
    for (std::size_t j = k; j < k + 4; ++j) readOne(at(j), x + j, y + j, z + j);
  }
  for (; k < n; ++k) readOne(at(k), x + k, y + k, z + k);
}

/// All points from the first on, one array per coordinate.
PLANAR_MAPPING_INLINE void readPoints(const float* points, std::size_t stride, std::size_t n,
                                      float* x, float* y, float* z) {
  std::size_t k = 0;
  for (; k + 4 <= n; k += 4) {
    fetchAhead(points + k * stride, stride);
    readFour(points + k * stride, stride, x + k, y + k, z + k);
  }
  for (; k < n; ++k) readOne(points + k * stride, x + k, y + k, z + k);
}

}  // namespace planar_mapping::detail
