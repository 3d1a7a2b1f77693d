// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/raster_kernels.h"

#include <limits>

#include "planar_mapping/core/base/detail/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kLanes = 8;
constexpr std::size_t kBlock = kKernelBlock;
static_assert(kBlock % kLanes == 0);

struct Block {
  float x[kBlock];
  float y[kBlock];
  float z[kBlock];
};

template <std::size_t kStride>
__attribute__((always_inline)) inline void loadRun(const float* p, Block& block) {
  for (std::size_t k = 0; k < kBlock; ++k) {
    block.x[k] = p[k * kStride];
    block.y[k] = p[k * kStride + 1];
    block.z[k] = p[k * kStride + 2];
  }
}

/// Neighbours in memory, the strides of the common point types known to the compiler.
__attribute__((always_inline)) inline void loadRun(const float* p, std::size_t stride,
                                                   Block& block) {
  if (stride == 4) {
    loadRun<4>(p, block);
  } else if (stride == 3) {
    loadRun<3>(p, block);
  } else if (stride == 8) {
    loadRun<8>(p, block);
  } else {
    for (std::size_t k = 0; k < kBlock; ++k) {
      block.x[k] = p[k * stride];
      block.y[k] = p[k * stride + 1];
      block.z[k] = p[k * stride + 2];
    }
  }
}

/// Loads up to a block of selected points; the last point is repeated where there are fewer.
__attribute__((always_inline)) inline void load(const PointSelection& points, std::size_t first,
                                                Block& block) {
  const std::size_t left = points.size - first;
  const std::size_t start =
      points.indices ? static_cast<std::size_t>(points.indices[first]) : first;
  // Inliers of organized clouds come in runs of consecutive pixels.
  if (left >= kBlock &&
      (!points.indices || points.indices[first + kBlock - 1] - points.indices[first] ==
                              static_cast<int>(kBlock - 1))) {
    loadRun(points.data + start * points.stride, points.stride, block);
    return;
  }
  for (std::size_t k = 0; k < kBlock; ++k) {
    const std::size_t i = first + (k < left ? k : left - 1);
    const float* p =
        points.data +
        (points.indices ? static_cast<std::size_t>(points.indices[i]) : i) * points.stride;
    block.x[k] = p[0];
    block.y[k] = p[1];
    block.z[k] = p[2];
  }
}

__attribute__((always_inline)) inline void dotWith(const Block& block, const double* axis,
                                                   double offset, double* result) {
  const double ax = axis[0], ay = axis[1], az = axis[2];
  for (std::size_t k = 0; k < kBlock; ++k) {
    result[k] = ax * static_cast<double>(block.x[k]) + ay * static_cast<double>(block.y[k]) +
                az * static_cast<double>(block.z[k]) + offset;
  }
}

/// Clamped to [low, high]; what is not a number becomes low.
__attribute__((always_inline)) inline void floorOf(const float* value, float scale, float low,
                                                   float high, std::int32_t* cell) {
  for (std::size_t k = 0; k < kBlock; ++k) {
    float scaled = value[k] * scale;
    scaled = scaled > low ? scaled : low;
    scaled = scaled < high ? scaled : high;
    const auto truncated = static_cast<std::int32_t>(scaled);
    cell[k] = truncated - (static_cast<float>(truncated) > scaled ? 1 : 0);
  }
}

}  // namespace

PLANAR_MAPPING_MULTIVERSION
PlaneBounds projectToPlane(const PointSelection& points, const PlaneAxes& axes, double* u,
                           double* v) {
  const std::size_t size = points.size;
  for (std::size_t first = 0; first < size; first += kBlock) {
    Block block;
    load(points, first, block);
    dotWith(block, axes.u, axes.u_offset, u + first);
    dotWith(block, axes.v, axes.v_offset, v + first);
  }

  // Lanes of their own, because floating-point minima may not be reordered by the compiler. Not a
  // number never compares as smaller or larger; infinities are cut off by the largest double.
  const double huge = std::numeric_limits<double>::max();
  double low_u[kLanes], low_v[kLanes], high_u[kLanes], high_v[kLanes];
  for (std::size_t k = 0; k < kLanes; ++k) {
    low_u[k] = low_v[k] = huge;
    high_u[k] = high_v[k] = -huge;
  }
  for (std::size_t i = 0; i < size; i += kLanes) {  // whole blocks: the last point is repeated
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double a = u[i + k];
      const double b = v[i + k];
      low_u[k] = a < low_u[k] ? a : low_u[k];
      low_v[k] = b < low_v[k] ? b : low_v[k];
      high_u[k] = a > high_u[k] ? a : high_u[k];
      high_v[k] = b > high_v[k] ? b : high_v[k];
    }
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
  const float scale = static_cast<float>(cells_per_metre);
  const float low = -static_cast<float>(limit), high = static_cast<float>(limit);
  const std::int32_t none = std::numeric_limits<std::int32_t>::min();
  for (std::size_t first = 0; first < points.size; first += kBlock) {
    Block block;
    load(points, first, block);
    std::int32_t* const bx = x + first;
    std::int32_t* const by = y + first;
    std::int32_t* const bz = z + first;
    floorOf(block.x, scale, low, high, bx);
    floorOf(block.y, scale, low, high, by);
    floorOf(block.z, scale, low, high, bz);
    for (std::size_t k = 0; k < kBlock; ++k) {
      const std::int32_t outside = (bx[k] <= -limit) | (bx[k] >= limit) | (by[k] <= -limit) |
                                   (by[k] >= limit) | (bz[k] <= -limit) | (bz[k] >= limit);
      bx[k] = outside ? none : bx[k];
      by[k] = outside ? none : by[k];
      bz[k] = outside ? none : bz[k];
    }
  }
}

}  // namespace planar_mapping::detail
