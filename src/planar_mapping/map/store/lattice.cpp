// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/store/lattice.h"

#include <cmath>

#include "planar_mapping/base/gather_points.h"
#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {

namespace {

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

/// Both kOutside where one is.
PLANAR_MAPPING_MULTIVERSION
void leaveTogether(double* __restrict u, double* __restrict v, std::size_t n) {
  const double outside = kOutside;
  for (std::size_t i = 0; i < n; ++i) {
    const double a = u[i];
    const double b = v[i];
    u[i] = b == outside ? outside : a;
    v[i] = a == outside ? outside : b;
  }
}

// One step each: gcc vectorises them, but not their union.

PLANAR_MAPPING_MULTIVERSION
void roundDown(const double* __restrict values, std::size_t n, std::int32_t* __restrict cells) {
  for (std::size_t i = 0; i < n; ++i) {
    const double v = values[i];
    const auto towards_zero = static_cast<std::int32_t>(v);
    cells[i] = towards_zero - (v < static_cast<double>(towards_zero) ? 1 : 0);
  }
}

/// kOutside stays.
PLANAR_MAPPING_MULTIVERSION
void clampCells(std::int32_t* __restrict cells, std::size_t n, std::int32_t low,
                std::int32_t high) {
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t cell = cells[i];
    std::int32_t clamped = cell < low ? low : cell;
    clamped = clamped > high ? high : clamped;
    cells[i] = cell == kOutside ? kOutside : clamped;
  }
}

void toCells(const double* values, std::size_t n, std::int32_t low, std::int32_t high,
             std::int32_t* cells) {
  roundDown(values, n, cells);
  const bool any = low <= -kLatticeLimit && high >= kLatticeLimit - 1;
  if (!any) clampCells(cells, n, low, high);
}

PLANAR_MAPPING_MULTIVERSION
void findChanges(const std::int32_t* __restrict a, const std::int32_t* __restrict b, std::size_t n,
                 std::uint32_t* __restrict changed) {
  for (std::size_t i = 1; i < n; ++i) {
    changed[i] = ((a[i] ^ a[i - 1]) | (b[i] ^ b[i - 1])) != 0 ? 1u : 0u;
  }
}

}  // namespace

void planeCoordinates(const float* data, std::size_t stride, const int* indices, std::size_t n,
                      const double* m, double* u, double* v) {
  float x[kBatch];
  float y[kBatch];
  float z[kBatch];
  gatherPoints(data, stride, indices, n, x, y, z);
  coordinates(x, y, z, n, m, u);
  coordinates(x, y, z, n, m + 4, v);
  leaveTogether(u, v, n);
}

void CellRuns::find(const double* u, const double* v, std::size_t n, const CellWindow& window) {
  size = 0;
  if (n == 0) return;
  toCells(u, n, window.low_a, window.high_a, a);
  toCells(v, n, window.low_b, window.high_b, b);
  std::uint32_t changed[kBatch];
  findChanges(a, b, n, changed);
  first[0] = 0;
  std::size_t run = 1;
  for (std::size_t i = 1; i < n; ++i) {  // without a branch
    first[run] = static_cast<std::uint32_t>(i);
    run += changed[i];
  }
  first[run] = static_cast<std::uint32_t>(n);
  size = run;
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
