// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "disparity_cells.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "planar_mapping/core/parallel.h"
#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A row of points in disparity space.
struct Lines {
  float* x;
  float* y;
  float* d;
  const float* mask;  ///< 0 or NaN per point
};

template <std::size_t kStride>
inline __attribute__((always_inline)) void convertPoints(const float* points, std::size_t stride,
                                                         int width, float focal, float factor,
                                                         const Lines& lines) {
  const std::size_t step = kStride > 0 ? kStride : stride;
  float* __restrict x = lines.x;
  float* __restrict y = lines.y;
  float* __restrict d = lines.d;
  for (int i = 0; i < width; ++i) {
    const float* p = points + static_cast<std::size_t>(i) * step;
    // Without a branch, or the loop is not vectorised: behind the camera D is negative.
    const float inverse = 1.0F / p[2];
    const float px = focal * p[0] * inverse;
    const float py = focal * p[1] * inverse;
    const float pd = factor * inverse;
    // Zero, or NaN if anything is not finite; a point at infinity has no disparity.
    const float mark = (px - px) + (py - py) + (pd - pd) + lines.mask[i];
    const float counts = pd > 0.0F ? mark : kNaN;
    x[i] = px + counts;
    y[i] = py + counts;
    d[i] = pd + counts;
  }
}

/// A row of points to disparity space; what is not in front of the camera or masked becomes NaN.
PLANAR_MAPPING_MULTIVERSION
void convertRow(const float* points, std::size_t stride, int width, float focal, float factor,
                const Lines& lines) {
  if (stride == 4) return convertPoints<4>(points, 4, width, focal, factor, lines);
  if (stride == 3) return convertPoints<3>(points, 3, width, focal, factor, lines);
  convertPoints<0>(points, stride, width, focal, factor, lines);
}

/// Up to four rows of an image, those of a row of quarters, into \p tiles: then each line of the
/// cache is written once.
PLANAR_MAPPING_MULTIVERSION
void tileRows(const float* lines, int rows, int width, float* tiles) {
  const auto line = static_cast<std::size_t>(width);
  const int whole = rows == kQuarterSide ? width / kQuarterSide : 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float* from = lines + static_cast<std::size_t>(axis) * kQuarterSide * line;
    float* out = tiles + axis * kTileArea;
    for (int quarter = 0; quarter < whole; ++quarter) {
      float* to = out + std::size_t{3} * kTileArea * (quarter / 2) + quarter % 2 * kQuarterArea;
      const float* first = from + quarter * kQuarterSide;
      for (int row = 0; row < kQuarterSide; ++row) {
        // Sizes the compiler knows are single moves.
        std::memcpy(to + row * kQuarterSide, first + row * line, kQuarterSide * sizeof(float));
      }
    }
    for (int row = 0; row < rows; ++row) {
      for (int i = whole * kQuarterSide; i < width; ++i) {
        out[std::size_t{3} * kTileArea * (i / kTileSide) + pixelInTile(row, i % kTileSide)] =
            from[row * line + i];
      }
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
  const auto focal = static_cast<float>(camera.focal_length);
  const auto factor = static_cast<float>(camera.baseline * camera.focal_length);
  const auto width = static_cast<std::size_t>(cloud.width);
  parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t tile_row) {
    float* tiles = cloud.xyz + std::size_t{3} * kTileArea * cloud.columns * tile_row;
    const std::size_t first = tile_row * kTileSide;
    const int rows = std::min(kTileSide, cloud.height - static_cast<int>(first));
    if (rows < kTileSide || cloud.width < cloud.columns * kTileSide) {
      std::fill_n(tiles, std::size_t{3} * kTileArea * cloud.columns, kNaN);
    }
    // x, y and d of four rows each, and the mask.
    const std::unique_ptr<float[]> room(new float[13 * width]);
    float* mask = room.get() + 12 * width;
    std::fill_n(mask, width, 0.0F);
    const int* at = nullptr;
    const int* last = nullptr;
    if (indices != nullptr) {
      last = indices->data() + indices->size();
      at = std::lower_bound(indices->data(), last, static_cast<int>(first * width));
    }
    for (int row = 0; row < rows; ++row) {
      const std::size_t begin = (first + static_cast<std::size_t>(row)) * width;
      if (indices != nullptr) {
        std::fill_n(mask, width, kNaN);
        const auto end = static_cast<int>(begin + width);
        for (; at != last && *at < end; ++at) mask[static_cast<std::size_t>(*at) - begin] = 0.0F;
      }
      const int in_quarter = row % kQuarterSide;
      float* line = room.get() + static_cast<std::size_t>(in_quarter) * width;
      const Lines lines = {line, line + 4 * width, line + 8 * width, mask};
      convertRow(points[begin], points.stride, cloud.width, focal, factor, lines);
      if (in_quarter + 1 == kQuarterSide || row + 1 == rows) {
        tileRows(room.get(), in_quarter + 1, cloud.width, tiles + pixelInTile(row - in_quarter, 0));
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
