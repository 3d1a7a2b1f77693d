// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

// Plain loops over points, compiled for several instruction sets; no Eigen in here.
namespace planar_mapping::detail {

/// Kernels work on whole blocks of points: output arrays must have room for the next multiple of
/// this, where the last point is repeated.
constexpr std::size_t kKernelBlock = 16;

/// A strided cloud and the points of it that count.
struct PointSelection {
  const float* data = nullptr;   ///< x y z
  std::size_t stride = 3;        ///< floats from point to point
  const int* indices = nullptr;  ///< ascending; null = the first size points
  std::size_t size = 0;
};

/// Coordinates in a plane: u . p + u_offset, v . p + v_offset.
struct PlaneAxes {
  double u[3];
  double v[3];
  double u_offset;
  double v_offset;
};

/// Extent of plane coordinates; low > high if no point is finite.
struct PlaneBounds {
  double low_u;
  double low_v;
  double high_u;
  double high_v;
};

/// Writes the plane coordinates of the selected points; non-finite ones give non-finite values.
PlaneBounds projectToPlane(const PointSelection& points, const PlaneAxes& axes, double* u,
                           double* v);

/// Where plane coordinates fall on a raster of columns x rows cells.
struct RasterGrid {
  double low_u;
  double low_v;
  double cells_per_metre;
  std::int32_t columns;
  std::int32_t rows;
};

/// Number of the cell (row * columns + column) of each point, -1 for non-finite ones. Points on
/// the upper edge count as inside.
void cellNumbers(const double* u, const double* v, std::size_t size, const RasterGrid& grid,
                 std::int32_t* cell);

/// Cells of the grid of all space: floor(p * cells_per_metre), INT32_MIN in all three where that
/// is not a number or beyond +-limit. In single precision, as the points are.
void gridCells(const PointSelection& points, double cells_per_metre, std::int32_t limit,
               std::int32_t* x, std::int32_t* y, std::int32_t* z);

}  // namespace planar_mapping::detail
