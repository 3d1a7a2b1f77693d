// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstring>

#include "planar_mapping/core/simd.h"

// To be called from functions that exist for several instruction sets (core/simd.h).
namespace planar_mapping::detail {

using FourFloats = float __attribute__((vector_size(16)));

/// Asks for the points that come a page later: what the processor fetches by itself ends with each
/// page, and a pass over a cloud larger than its caches would wait there. A hint, never an access.
PLANAR_MAPPING_INLINE void fetchAhead(const float* point, std::size_t stride) {
  constexpr std::size_t kPoints = 256;
  __builtin_prefetch(point + kPoints * stride);
}

/// Four points side by side, one vector per coordinate.
/// \param kStride floats from point to point, at least 4; behind the last point nothing is read
template <std::size_t kStride>
PLANAR_MAPPING_INLINE void readFour(const float* points, FourFloats& x, FourFloats& y,
                                    FourFloats& z) {
  static_assert(kStride >= 4, "a point is read together with the float behind it");
  FourFloats a, b, c, d;
  std::memcpy(&a, points, sizeof(a));
  std::memcpy(&b, points + kStride, sizeof(b));
  std::memcpy(&c, points + 2 * kStride, sizeof(c));
  std::memcpy(&d, points + 3 * kStride - 1, sizeof(d));  // the float before the last point
  const FourFloats ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const FourFloats cd = __builtin_shufflevector(c, d, 0, 5, 1, 6);
  const FourFloats ab_z = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const FourFloats cd_z = __builtin_shufflevector(c, d, 2, 7, 3, 4);
  x = __builtin_shufflevector(ab, cd, 0, 1, 4, 5);
  y = __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
  z = __builtin_shufflevector(ab_z, cd_z, 0, 1, 4, 5);
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

/// The same into arrays.
PLANAR_MAPPING_INLINE void readFour(const float* points, std::size_t stride, float* x, float* y,
                                    float* z) {
  FourFloats in_x, in_y, in_z;
  readFour(points, stride, in_x, in_y, in_z);
  std::memcpy(x, &in_x, sizeof(in_x));
  std::memcpy(y, &in_y, sizeof(in_y));
  std::memcpy(z, &in_z, sizeof(in_z));
}

/// The points at the indices, one array per coordinate. Indices mostly come in runs of neighbours:
/// those are read together.
/// \param stride floats from point to point, at least 3
PLANAR_MAPPING_INLINE void gatherPoints(const float* points, std::size_t stride, const int* indices,
                                        std::size_t n, float* x, float* y, float* z) {
  constexpr std::size_t kRun = 16;
  std::size_t k = 0;
  for (; k + kRun <= n; k += kRun) {
    const int first = indices[k];
    const float* run = points + static_cast<std::size_t>(first) * stride;
    for (std::size_t i = 0; i < kRun; i += 4) fetchAhead(run + i * stride, stride);
    int apart = 0;
    for (std::size_t i = 0; i < kRun; ++i) apart |= (indices[k + i] - first) ^ static_cast<int>(i);
    if (apart == 0) {
      for (std::size_t i = k; i < k + kRun; i += 4) {
        readFour(run + (i - k) * stride, stride, x + i, y + i, z + i);
      }
      continue;
    }
    for (std::size_t i = k; i < k + kRun; ++i) {
      const float* p = points + static_cast<std::size_t>(indices[i]) * stride;
      x[i] = p[0];
      y[i] = p[1];
      z[i] = p[2];
    }
  }
  for (; k < n; ++k) {
    const float* p = points + static_cast<std::size_t>(indices[k]) * stride;
    x[k] = p[0];
    y[k] = p[1];
    z[k] = p[2];
  }
}

/// All points from the first on, one array per coordinate.
PLANAR_MAPPING_INLINE void readPoints(const float* points, std::size_t stride, std::size_t n,
                                      float* x, float* y, float* z) {
  std::size_t k = 0;
  for (; k + 4 <= n; k += 4) {
    fetchAhead(points + k * stride, stride);
    readFour(points + k * stride, stride, x + k, y + k, z + k);
  }
  for (; k < n; ++k) {
    const float* p = points + k * stride;
    x[k] = p[0];
    y[k] = p[1];
    z[k] = p[2];
  }
}

}  // namespace planar_mapping::detail
