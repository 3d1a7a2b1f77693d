// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "raster_kernels.h"

#include <limits>

#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kLanes = 8;

}  // namespace

PLANAR_MAPPING_MULTIVERSION
PlaneBounds projectToPlane(const PointSelection& points, const PlaneAxes& axes, double* u,
                           double* v) {
  const float* const data = points.data;
  const std::size_t stride = points.stride;
  const int* const indices = points.indices;
  const std::size_t size = points.size;
  const double ux = axes.u[0], uy = axes.u[1], uz = axes.u[2], u0 = axes.u_offset;
  const double vx = axes.v[0], vy = axes.v[1], vz = axes.v[2], v0 = axes.v_offset;
  for (std::size_t i = 0; i < size; ++i) {
    const float* p = data + static_cast<std::size_t>(indices[i]) * stride;
    const double x = p[0], y = p[1], z = p[2];
    u[i] = ux * x + uy * y + uz * z + u0;
    v[i] = vx * x + vy * y + vz * z + v0;
  }

  // Lanes of their own, because floating-point minima may not be reordered by the compiler. Not a
  // number never compares as smaller or larger; infinities are cut off by the largest double.
  const double huge = std::numeric_limits<double>::max();
  double low_u[kLanes], low_v[kLanes], high_u[kLanes], high_v[kLanes];
  for (std::size_t k = 0; k < kLanes; ++k) {
    low_u[k] = low_v[k] = huge;
    high_u[k] = high_v[k] = -huge;
  }
  const std::size_t whole = size - size % kLanes;
  for (std::size_t i = 0; i < whole; i += kLanes) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double a = u[i + k];
      const double b = v[i + k];
      low_u[k] = a < low_u[k] ? a : low_u[k];
      low_v[k] = b < low_v[k] ? b : low_v[k];
      high_u[k] = a > high_u[k] ? a : high_u[k];
      high_v[k] = b > high_v[k] ? b : high_v[k];
    }
  }
  for (std::size_t i = whole; i < size; ++i) {
    low_u[0] = u[i] < low_u[0] ? u[i] : low_u[0];
    low_v[0] = v[i] < low_v[0] ? v[i] : low_v[0];
    high_u[0] = u[i] > high_u[0] ? u[i] : high_u[0];
    high_v[0] = v[i] > high_v[0] ? v[i] : high_v[0];
  }
  PlaneBounds bounds{low_u[0], low_v[0], high_u[0], high_v[0]};
  for (std::size_t k = 1; k < kLanes; ++k) {
    bounds.low_u = low_u[k] < bounds.low_u ? low_u[k] : bounds.low_u;
    bounds.low_v = low_v[k] < bounds.low_v ? low_v[k] : bounds.low_v;
    bounds.high_u = high_u[k] > bounds.high_u ? high_u[k] : bounds.high_u;
    bounds.high_v = high_v[k] > bounds.high_v ? high_v[k] : bounds.high_v;
  }
  return bounds;
}

PLANAR_MAPPING_MULTIVERSION
void cellNumbers(const double* u, const double* v, std::size_t size, const RasterGrid& grid,
                 std::int32_t* cell) {
  const double low_u = grid.low_u, low_v = grid.low_v, scale = grid.cells_per_metre;
  const double last_a = grid.columns - 1, last_b = grid.rows - 1;
  const std::int32_t columns = grid.columns;
  for (std::size_t i = 0; i < size; ++i) {
    const double a = (u[i] - low_u) * scale;
    const double b = (v[i] - low_v) * scale;
    // Comparisons are written so that what is not a number ends in the first cell, then out.
    const double clamped_a = a > 0.0 ? (a < last_a ? a : last_a) : 0.0;
    const double clamped_b = b > 0.0 ? (b < last_b ? b : last_b) : 0.0;
    const std::int32_t number =
        static_cast<std::int32_t>(clamped_b) * columns + static_cast<std::int32_t>(clamped_a);
    const double finite = (a - a) + (b - b);  // 0, or not a number
    cell[i] = finite == 0.0 ? number : -1;
  }
}

PLANAR_MAPPING_MULTIVERSION
void gridCells(const PointSelection& points, double cells_per_metre, std::int32_t limit,
               std::int32_t* x, std::int32_t* y, std::int32_t* z) {
  const float* const data = points.data;
  const std::size_t stride = points.stride;
  const int* const indices = points.indices;
  const double low = -static_cast<double>(limit), high = limit;
  const std::int32_t none = std::numeric_limits<std::int32_t>::min();
  for (std::size_t i = 0; i < points.size; ++i) {
    const float* p = data + (indices ? static_cast<std::size_t>(indices[i]) : i) * stride;
    const double a = p[0] * cells_per_metre;
    const double b = p[1] * cells_per_metre;
    const double c = p[2] * cells_per_metre;
    const bool inside = a > low && a < high && b > low && b < high && c > low && c < high;
    const double ca = inside ? a : 0.0, cb = inside ? b : 0.0, cc = inside ? c : 0.0;
    const auto ia = static_cast<std::int32_t>(ca), ib = static_cast<std::int32_t>(cb),
               ic = static_cast<std::int32_t>(cc);
    // floor by truncation: one less where that rounded up
    x[i] = inside ? ia - (static_cast<double>(ia) > ca) : none;
    y[i] = inside ? ib - (static_cast<double>(ib) > cb) : none;
    z[i] = inside ? ic - (static_cast<double>(ic) > cc) : none;
  }
}

}  // namespace planar_mapping::detail
