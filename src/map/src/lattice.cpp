// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "lattice.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {

namespace {

void gather(const float* data, std::size_t stride, const int* indices, std::size_t n, float* x,
            float* y, float* z) {
  for (std::size_t i = 0; i < n; ++i) {
    const float* p = data + static_cast<std::size_t>(indices[i]) * stride;
    x[i] = p[0];
    y[i] = p[1];
    z[i] = p[2];
  }
}

// Two loops each: gcc vectorises them, but not their union.

/// m0 x + m1 y + m2 z + m3, or kOutside: the comparisons are false for NaN.
PLANAR_MAPPING_MULTIVERSION
void coordinates(const float* __restrict x, const float* __restrict y, const float* __restrict z,
                 std::size_t n, const double* m, double* __restrict values) {
  const double m0 = m[0], m1 = m[1], m2 = m[2], m3 = m[3];
  const double limit = kLatticeLimit;
  const double outside = kOutside;
  for (std::size_t i = 0; i < n; ++i) {
    double v = m0 * static_cast<double>(x[i]) + m1 * static_cast<double>(y[i]) +
               m2 * static_cast<double>(z[i]) + m3;
    v = v > -limit ? v : outside;
    values[i] = v < limit ? v : outside;
  }
}

PLANAR_MAPPING_MULTIVERSION
void roundDown(const double* __restrict values, std::size_t n, std::int32_t* __restrict cells) {
  for (std::size_t i = 0; i < n; ++i) {
    const double v = values[i];
    const auto towards_zero = static_cast<std::int32_t>(v);
    cells[i] = towards_zero - (v < static_cast<double>(towards_zero) ? 1 : 0);
  }
}

}  // namespace

void planeCells(const float* data, std::size_t stride, const int* indices, std::size_t n,
                const double* m, std::int32_t* a, std::int32_t* b) {
  float x[kBatch];
  float y[kBatch];
  float z[kBatch];
  double values[kBatch];
  gather(data, stride, indices, n, x, y, z);
  coordinates(x, y, z, n, m, values);
  roundDown(values, n, a);
  coordinates(x, y, z, n, m + 4, values);
  roundDown(values, n, b);
}

void planeExtent(const float* data, std::size_t stride, const int* indices, std::size_t n,
                 const double* m, double* extent) {
  float x[kBatch];
  float y[kBatch];
  float z[kBatch];
  double u[kBatch];
  double v[kBatch];
  double low_u = extent[0], low_v = extent[1], high_u = extent[2], high_v = extent[3];
  for (std::size_t begin = 0; begin < n; begin += kBatch) {
    const std::size_t count = std::min(kBatch, n - begin);
    gather(data, stride, indices + begin, count, x, y, z);
    coordinates(x, y, z, count, m, u);
    coordinates(x, y, z, count, m + 4, v);
    for (std::size_t i = 0; i < count; ++i) {
      if (u[i] == kOutside || v[i] == kOutside) continue;
      low_u = std::min(low_u, u[i]);
      low_v = std::min(low_v, v[i]);
      high_u = std::max(high_u, u[i]);
      high_v = std::max(high_v, v[i]);
    }
  }
  extent[0] = low_u;
  extent[1] = low_v;
  extent[2] = high_u;
  extent[3] = high_v;
}

PLANAR_MAPPING_MULTIVERSION
void worldCells(const float* data, std::size_t stride, const int* indices, std::size_t n,
                const double* m, double* xyz, std::int32_t* cells) {
  const double limit = kLatticeLimit;
  for (std::size_t i = 0; i < n; ++i) {
    const float* p = data + static_cast<std::size_t>(indices[i]) * stride;
    const double x = p[0], y = p[1], z = p[2];
    const double wx = m[0] * x + m[1] * y + m[2] * z + m[3];
    const double wy = m[4] * x + m[5] * y + m[6] * z + m[7];
    const double wz = m[8] * x + m[9] * y + m[10] * z + m[11];
    const bool inside =
        (wx > -limit) & (wx < limit) & (wy > -limit) & (wy < limit) & (wz > -limit) & (wz < limit);
    xyz[3 * i] = wx;
    xyz[3 * i + 1] = wy;
    xyz[3 * i + 2] = wz;
    cells[3 * i] = inside ? static_cast<std::int32_t>(std::floor(inside ? wx : 0.0)) : kOutside;
    cells[3 * i + 1] = static_cast<std::int32_t>(std::floor(inside ? wy : 0.0));
    cells[3 * i + 2] = static_cast<std::int32_t>(std::floor(inside ? wz : 0.0));
  }
}

}  // namespace planar_mapping::detail
