// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/disparity/disparity_cells.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/organized_lanes.h"
#include "planar_mapping/core/base/detail/gather_points.h"
#include "planar_mapping/core/base/detail/parallel.h"
#include "planar_mapping/core/base/detail/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

PLANAR_MAPPING_INLINE void join(const FourFloats& one, const FourFloats& other, FloatLanes& both) {
  both = __builtin_shufflevector(one, other, 0, 1, 2, 3, 4, 5, 6, 7);
}

/// Four values each.
PLANAR_MAPPING_INLINE void join(const float* one, const float* other, FloatLanes& both) {
  FourFloats first, second;
  std::memcpy(&first, one, sizeof(first));
  std::memcpy(&second, other, sizeof(second));
  join(first, second, both);
}

/// Four points each.
PLANAR_MAPPING_INLINE void readFours(const float* one, const float* other, std::size_t stride,
                                     FloatLanes& x, FloatLanes& y, FloatLanes& z) {
  FourFloats first[3], second[3];
  readFour(one, stride, first[0], first[1], first[2]);
  readFour(other, stride, second[0], second[1], second[2]);
  join(first[0], second[0], x);
  join(first[1], second[1], y);
  join(first[2], second[2], z);
}

/// What turns points into disparities.
struct Conversion {
  float focal;   ///< pixels
  float factor;  ///< B f, pixels times metres
};

/// Points to disparity space; what is not in front of the camera or masked becomes NaN.
/// \param mask 0 or NaN per point
PLANAR_MAPPING_INLINE void convert(const Conversion& conversion, const FloatLanes& mask,
                                   FloatLanes& x, FloatLanes& y, FloatLanes& z) {
  const FloatLanes inverse = 1.0F / z;
  const FloatLanes px = conversion.focal * x * inverse;
  const FloatLanes py = conversion.focal * y * inverse;
  const FloatLanes pd = conversion.factor * inverse;
  // Zero, or NaN if anything is not finite; a point at infinity has no disparity.
  const FloatLanes mark = (px - px) + (py - py) + (pd - pd) + mask;
  // Behind the camera D is negative.
  const FloatLanes counts = pd > 0.0F ? mark : FloatLanes{} + kNaN;
  x = px + counts;
  y = py + counts;
  z = pd + counts;
}

/// Four rows of an image, quarter by quarter, into \p tiles; what is left of a quarter at the end
/// of the rows stays.
/// \param mask rows of \p width values
PLANAR_MAPPING_MULTIVERSION
void convertQuarters(const float* points, std::size_t stride, int width, const float* mask,
                     const Conversion& conversion, float* tiles) {
  constexpr std::size_t kAhead = 8 * 3 * kTileArea;  // eight tiles on
  const std::size_t row = stride * static_cast<std::size_t>(width);
  for (int column = 0; column + kQuarterSide <= width; column += kQuarterSide) {
    float* to = tiles + std::size_t{3} * kTileArea * (column / kTileSide) +
                pixelInTile(0, column % kTileSide);
    for (int axis = 0; axis < 3; ++axis) __builtin_prefetch(to + kAhead + axis * kTileArea, 1);
    for (int r = 0; r < kQuarterSide; r += 2, to += kLanes) {
      const float* four = points + r * row + static_cast<std::size_t>(column) * stride;
      fetch(four + kQuarterSide * row);  // of the next four rows
      fetch(four + (kQuarterSide + 1) * row);
      FloatLanes x, y, z, masked;
      readFours(four, four + row, stride, x, y, z);
      join(mask + r * width + column, mask + (r + 1) * width + column, masked);
      convert(conversion, masked, x, y, z);
      std::memcpy(to, &x, sizeof(x));
      std::memcpy(to + kTileArea, &y, sizeof(y));
      std::memcpy(to + 2 * kTileArea, &z, sizeof(z));
    }
  }
}

/// One pixel into its tile.
PLANAR_MAPPING_MULTIVERSION
void convertPixel(const float* point, float mask, const Conversion& conversion, float* pixel) {
  FloatLanes x = FloatLanes{} + point[0];
  FloatLanes y = FloatLanes{} + point[1];
  FloatLanes z = FloatLanes{} + point[2];
  convert(conversion, FloatLanes{} + mask, x, y, z);
  pixel[0] = x[0];
  pixel[kTileArea] = y[0];
  pixel[2 * kTileArea] = z[0];
}

/// Mask of the points [begin, end): 0 for those that are listed (ascending, each once) from \p at
/// on, which is moved past them, NaN for the others.
void maskOthers(const int*& at, const int* last, int begin, int end, float* mask) {
  constexpr int kRun = 16;
  constexpr float kZeros[kRun] = {};
  std::fill_n(mask, end - begin, kNaN);
  while (at != last && *at < end) {
    // Neighbours mostly come together.
    if (last - at >= kRun && at[kRun - 1] - *at == kRun - 1 && at[kRun - 1] < end) {
      std::memcpy(mask + (*at - begin), kZeros, sizeof(kZeros));  // no call, unlike fill_n()
      at += kRun;
    } else {
      mask[*at++ - begin] = 0.0F;
    }
  }
}

}  // namespace

DisparityParams::DisparityParams(const MultiPlaneParams& params, const StereoNoise& noise_of_camera)
    : camera(noise_of_camera),
      noise(noise_of_camera.disparity_error),
      distance_threshold(params.distance_threshold),
      max_normal_deviation(params.max_normal_deviation),
      noise_factor(params.noise_factor),
      min_inliers(params.min_inliers) {}

TiledCloud tileDisparities(const PointsView& points, const Indices* indices,
                           const StereoNoise& camera, int threads) {
  TiledCloud cloud;
  cloud.width = static_cast<int>(points.width);
  cloud.height = static_cast<int>(points.height);
  cloud.columns = (cloud.width + kTileSide - 1) / kTileSide;
  cloud.rows = (cloud.height + kTileSide - 1) / kTileSide;
  const std::size_t coordinates = std::size_t{3} * kTileArea * cloud.tiles();
  const std::size_t sums = std::size_t{4} * kMoments * cloud.tiles();
  cloud.memory.reset(new double[coordinates / 2 + 2 * sums]);
  cloud.room[0] = cloud.memory.get();
  cloud.room[1] = cloud.room[0] + sums;
  cloud.xyz = reinterpret_cast<float*>(cloud.room[1] + sums);
  const Conversion conversion = {static_cast<float>(camera.focal_length),
                                 static_cast<float>(camera.baseline * camera.focal_length)};
  const auto width = static_cast<std::size_t>(cloud.width);
  parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t tile_row) {
    float* tiles = cloud.xyz + std::size_t{3} * kTileArea * cloud.columns * tile_row;
    const std::size_t first = tile_row * kTileSide;
    const int rows = std::min(kTileSide, cloud.height - static_cast<int>(first));
    if (rows < kTileSide || cloud.width < cloud.columns * kTileSide) {
      std::fill_n(tiles, std::size_t{3} * kTileArea * cloud.columns, kNaN);
    }
    std::vector<float> mask(kQuarterSide * width, 0.0F);
    const int* at = nullptr;
    const int* last = nullptr;
    if (indices != nullptr) {
      last = indices->data() + indices->size();
      at = std::lower_bound(indices->data(), last, static_cast<int>(first * width));
    }
    for (int row = 0; row < rows; row += kQuarterSide) {
      const std::size_t begin = (first + static_cast<std::size_t>(row)) * width;
      const int of_quarter = std::min(kQuarterSide, rows - row);
      if (indices != nullptr) {
        maskOthers(at, last, static_cast<int>(begin), static_cast<int>(begin + of_quarter * width),
                   mask.data());
      }
      int done = 0;
      if (of_quarter == kQuarterSide) {
        done = cloud.width / kQuarterSide * kQuarterSide;
        convertQuarters(points[begin], points.stride, cloud.width, mask.data(), conversion,
                        tiles + pixelInTile(row, 0));
      }
      for (int r = 0; r < of_quarter; ++r) {
        for (int column = done; column < cloud.width; ++column) {
          const std::size_t i = r * width + static_cast<std::size_t>(column);
          convertPixel(points[begin + i], mask[i], conversion,
                       tiles + std::size_t{3} * kTileArea * (column / kTileSide) +
                           pixelInTile(row + r, column % kTileSide));
        }
      }
    }
  });
  return cloud;
}

DisparityFit fitDisparity(const MomentSums& s) {
  constexpr double kFewest = 3.0;
  constexpr double kThinnest = 1e-6;  // of the extents' squares
  DisparityFit fit;
  const double n = s[kN];
  if (!(n >= kFewest)) return fit;
  const double inverse = 1.0 / n;
  const double mx = s[kX] * inverse;
  const double my = s[kY] * inverse;
  const double md = s[kZ] * inverse;
  const double xx = s[kXX] * inverse - mx * mx;
  const double xy = s[kXY] * inverse - mx * my;
  const double yy = s[kYY] * inverse - my * my;
  const double xd = s[kXZ] * inverse - mx * md;
  const double yd = s[kYZ] * inverse - my * md;
  const double dd = s[kZZ] * inverse - md * md;
  const double determinant = xx * yy - xy * xy;
  const double trace = xx + yy;
  if (!(determinant > kThinnest * trace * trace) || !(trace > 0.0)) return fit;
  const double p = (yy * xd - xy * yd) / determinant;
  const double q = (xx * yd - xy * xd) / determinant;
  const double larger = 0.5 * (trace + std::sqrt((xx - yy) * (xx - yy) + 4.0 * xy * xy));
  fit.p = static_cast<float>(p);
  fit.q = static_cast<float>(q);
  fit.x = static_cast<float>(mx);
  fit.y = static_cast<float>(my);
  fit.d = static_cast<float>(md);
  fit.residual = static_cast<float>(std::sqrt(std::max(0.0, dd - p * xd - q * yd)));
  fit.extent = static_cast<float>(std::sqrt(determinant / larger));
  fit.count = static_cast<float>(n);
  return fit;
}

std::vector<DisparityFit> fitDisparities(const CellGrid& grid) {
  std::vector<DisparityFit> fits(static_cast<std::size_t>(grid.cells()));
  MomentSums sums;
  for (int cell = 0; cell < grid.cells(); ++cell) {
    if (!(grid.count(cell) > 0.0)) continue;
    for (int m = 0; m < kMoments; ++m) sums[static_cast<std::size_t>(m)] = grid.moment(m)[cell];
    fits[static_cast<std::size_t>(cell)] = fitDisparity(sums);
  }
  return fits;
}

double estimateDisparityNoise(const std::vector<DisparityFit>& windows, int capacity,
                              const DisparityParams& params) {
  constexpr float kMinShare = 0.5F;
  constexpr std::size_t kFewest = 20;
  std::vector<float> residuals;
  for (const DisparityFit& fit : windows) {
    if (fit.count >= kMinShare * static_cast<float>(capacity)) residuals.push_back(fit.residual);
  }
  const double most = params.most_noise_share * params.camera.disparity_error;
  if (residuals.size() < kFewest) return most;
  const auto at =
      residuals.begin() + static_cast<std::ptrdiff_t>(params.noise_quantile *
                                                      static_cast<double>(residuals.size() - 1));
  std::nth_element(residuals.begin(), at, residuals.end());
  const double least = params.least_noise_share * params.camera.disparity_error;
  return std::clamp(static_cast<double>(*at), least, most);
}

void metricPlane(double p, double q, double r, const DisparityParams& params, double* normal,
                 double& height) {
  // D z = B f, so p f x + q f y + r z = B f.
  const double m[3] = {p * params.camera.focal_length, q * params.camera.focal_length, r};
  const double length = std::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
  for (int axis = 0; axis < 3; ++axis) normal[axis] = -m[axis] / length;
  height = params.factor() / length;
}

void DisparityPlane::fit(const DisparityParams& params) {
  const DisparityFit found = fitDisparity(sums);
  valid = found.count > 0.0F && std::isfinite(found.p) && std::isfinite(found.q);
  if (!valid) return;
  // Again in double precision: a plane may be as wide as the image.
  const double n = sums[kN];
  const double mx = sums[kX] / n;
  const double my = sums[kY] / n;
  const double md = sums[kZ] / n;
  const double xx = sums[kXX] / n - mx * mx;
  const double xy = sums[kXY] / n - mx * my;
  const double yy = sums[kYY] / n - my * my;
  const double xd = sums[kXZ] / n - mx * md;
  const double yd = sums[kYZ] / n - my * md;
  const double determinant = xx * yy - xy * xy;
  p = (yy * xd - xy * yd) / determinant;
  q = (xx * yd - xy * xd) / determinant;
  r = md - p * mx - q * my;
  residual = found.residual;
  metricPlane(p, q, r, params, normal, height);
  valid = std::isfinite(height) && height > 0.0;
}

double DisparityPlane::meanSquare(const MomentSums& o) const {
  const double products =
      p * p * o[kXX] + q * q * o[kYY] + o[kZZ] + 2.0 * (p * q * o[kXY] - p * o[kXZ] - q * o[kYZ]);
  const double along = p * o[kX] + q * o[kY] - o[kZ];
  return std::max(0.0, (products + 2.0 * r * along) / o[kN] + r * r);
}

}  // namespace planar_mapping::detail
