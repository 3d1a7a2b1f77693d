// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "lattice.h"

#include <cmath>

#include "key_map.h"
#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {

PLANAR_MAPPING_MULTIVERSION
void planeCells(const float* data, std::size_t stride, const int* indices, std::size_t n,
                const double* m, std::int32_t* a, std::int32_t* b) {
  const double limit = kLatticeLimit;
  for (std::size_t i = 0; i < n; ++i) {
    const float* p = data + static_cast<std::size_t>(indices[i]) * stride;
    const double x = p[0], y = p[1], z = p[2];
    const double u = std::floor(m[0] * x + m[1] * y + m[2] * z + m[3]);
    const double v = std::floor(m[4] * x + m[5] * y + m[6] * z + m[7]);
    const bool inside = (u > -limit) & (u < limit) & (v > -limit) & (v < limit);  // false for NaN
    a[i] = inside ? static_cast<std::int32_t>(inside ? u : 0.0) : kOutside;
    b[i] = static_cast<std::int32_t>(inside ? v : 0.0);
  }
}

PLANAR_MAPPING_MULTIVERSION
void planeExtent(const float* data, std::size_t stride, const int* indices, std::size_t n,
                 const double* m, double* extent) {
  double low_u = extent[0], low_v = extent[1], high_u = extent[2], high_v = extent[3];
  const double limit = kLatticeLimit;
  for (std::size_t i = 0; i < n; ++i) {
    const float* p = data + static_cast<std::size_t>(indices[i]) * stride;
    const double x = p[0], y = p[1], z = p[2];
    const double u = m[0] * x + m[1] * y + m[2] * z + m[3];
    const double v = m[4] * x + m[5] * y + m[6] * z + m[7];
    const bool inside = (u > -limit) & (u < limit) & (v > -limit) & (v < limit);
    low_u = (inside & (u < low_u)) ? u : low_u;
    low_v = (inside & (v < low_v)) ? v : low_v;
    high_u = (inside & (u > high_u)) ? u : high_u;
    high_v = (inside & (v > high_v)) ? v : high_v;
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
