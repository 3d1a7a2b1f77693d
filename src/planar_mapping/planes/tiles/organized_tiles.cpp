// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/planes/tiles/organized_tiles.h"

#include <algorithm>
#include <limits>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A point relative to the origin. A coordinate minus itself is 0, or NaN if it is not finite;
/// added to all three it marks the pixel.
void copyPixel(const float* point, const float* origin, float* pixel) {
  const float x = point[0] - origin[0];
  const float y = point[1] - origin[1];
  const float z = point[2] - origin[2];
  const bool is_nothing = point[0] == 0.0F && point[1] == 0.0F && point[2] == 0.0F;
  const float mark = is_nothing ? kNaN : (x - x) + (y - y) + (z - z);
  pixel[0] = x + mark;
  pixel[kTileArea] = y + mark;
  pixel[2 * kTileArea] = z + mark;
}

/// As copyPixel() for whole tiles of a row of them.
/// \param from   the first pixel
/// \param stride floats from a pixel to the next ...
/// \param line   ... and from a row to the next
PLANAR_MAPPING_MULTIVERSION
void copyTiles(const float* from, std::size_t stride, std::size_t line, int columns,
               const float* origin, float* tiles) {
  const FloatLanes none = FloatLanes{} + kNaN;
  for (int row = 0; row < kTileSide; ++row) {
    const float* point = from + static_cast<std::size_t>(row) * line;
    for (int column = 0; column < columns; ++column, point += kTileSide * stride) {
      FloatLanes x, y, z;
      for (int k = 0; k < kTileSide; ++k) {
        const float* p = point + static_cast<std::size_t>(k) * stride;
        x[k] = p[0];
        y[k] = p[1];
        z[k] = p[2];
      }
      const IntLanes is_nothing = (x == 0.0F) & (y == 0.0F) & (z == 0.0F);
      x -= origin[0];
      y -= origin[1];
      z -= origin[2];
      FloatLanes mark = (x - x) + (y - y) + (z - z);
      mark = is_nothing ? none : mark;
      x += mark;
      y += mark;
      z += mark;
      float* to = tiles + std::size_t{3} * kTileArea * column + pixelInTile(row, 0);
      const std::size_t half = kQuarterSide * sizeof(float);
      for (int axis = 0; axis < 3; ++axis) {
        const FloatLanes& all = axis == 0 ? x : (axis == 1 ? y : z);
        const auto* bytes = reinterpret_cast<const char*>(&all);
        std::memcpy(to + axis * kTileArea, bytes, half);
        std::memcpy(to + axis * kTileArea + kQuarterArea, bytes + half, half);
      }
    }
  }
}

void copyTileRow(const PointsView& points, const float* origin, int tile_row, int columns,
                 float* tiles) {
  const int width = static_cast<int>(points.width);
  const int rows = std::min(kTileSide, static_cast<int>(points.height) - tile_row * kTileSide);
  const int whole = rows == kTileSide ? width / kTileSide : 0;  // tiles
  const std::size_t first = static_cast<std::size_t>(tile_row) * kTileSide * points.width;
  copyTiles(points[first], points.stride, points.stride * points.width, whole, origin, tiles);
  if (whole == columns) return;
  std::fill(tiles + std::size_t{3} * kTileArea * whole,
            tiles + std::size_t{3} * kTileArea * columns, kNaN);
  for (int row = 0; row < rows; ++row) {
    for (int column = whole * kTileSide; column < width; ++column) {
      copyPixel(points[first + static_cast<std::size_t>(row) * points.width +
                       static_cast<std::size_t>(column)],
                origin,
                tiles + std::size_t{3} * kTileArea * (column / kTileSide) +
                    pixelInTile(row, column % kTileSide));
    }
  }
}

/// The points of row \p tile_row of tiles that are listed, ascending.
void copyIndexed(const PointsView& points, const Indices& indices, const float* origin,
                 int tile_row, int columns, float* tiles) {
  std::fill_n(tiles, std::size_t{3} * kTileArea * columns, kNaN);
  const int width = static_cast<int>(points.width);
  const int height = static_cast<int>(points.height);
  const int first = tile_row * kTileSide;
  auto at = std::lower_bound(indices.begin(), indices.end(), first * width);
  for (int row = first; row < std::min(height, first + kTileSide); ++row) {
    for (; at != indices.end() && *at < (row + 1) * width; ++at) {
      const int column = *at - row * width;
      copyPixel(points[static_cast<std::size_t>(*at)], origin,
                tiles + std::size_t{3} * kTileArea * (column / kTileSide) +
                    pixelInTile(row - first, column % kTileSide));
    }
  }
}

/// Points to disparity space, in place; what is not in front of the camera becomes NaN.
PLANAR_MAPPING_MULTIVERSION
void toDisparities(float focal, float factor, int columns, float* tiles) {
  const FloatLanes none = FloatLanes{} + kNaN;
  for (int column = 0; column < columns; ++column) {
    float* tile = tiles + std::size_t{3} * kTileArea * column;
    for (int k = 0; k < kTileArea; k += kLanes) {
      FloatLanes x, y, z;
      load(tile + k, x, y, z);
      const FloatLanes inverse = 1.0F / z;
      x = focal * x * inverse;
      y = focal * y * inverse;
      z = factor * inverse;
      // Zero, or NaN if anything is not finite: a point at infinity has no disparity, one behind
      // the camera a negative one.
      FloatLanes mark = (x - x) + (y - y) + (z - z);
      mark = z > 0.0F ? mark : none;
      x += mark;
      y += mark;
      z += mark;
      std::memcpy(tile + k, &x, sizeof(x));
      std::memcpy(tile + kTileArea + k, &y, sizeof(y));
      std::memcpy(tile + 2 * kTileArea + k, &z, sizeof(z));
    }
  }
}

bool findOrigin(const PointsView& points, const Indices* indices, std::size_t& origin) {
  const std::size_t size = indices ? indices->size() : points.size;
  for (std::size_t i = 0; i < size; ++i) {
    origin = indices ? static_cast<std::size_t>((*indices)[i]) : i;
    if (points.isMeasured(origin)) return true;
  }
  return false;
}

// Sums about the first point; a pixel counts if it is finite and carries the label (labels may be
// null).
PLANAR_MAPPING_INLINE void sumPixels(const float* x, const std::int16_t* labels, std::int16_t label,
                                     int pixels, double* out, std::size_t out_stride) {
  const FloatLanes zero = {};
  const FloatLanes one = zero + 1.0F;
  int first = 0;
  if (!(x[0] == x[0])) {
    FloatLanes finite[2] = {zero, zero};
    for (int k = 0; k < pixels; k += kLanes) {
      FloatLanes eight;
      load(x + k, eight);
      finite[k / kLanes % 2] += eight == eight ? one : zero;
    }
    if (!(sumOf(finite) > 0.0F)) first = pixels;
  }
  while (first < pixels && !(x[first] == x[first] && (!labels || labels[first] == label))) ++first;
  if (first == pixels) {
    for (int m = 0; m < kMoments; ++m) out[m * out_stride] = 0.0;
    return;
  }
  const float ox = x[first];
  const float oy = x[kTileArea + first];
  const float oz = x[2 * kTileArea + first];
  FloatLanes sum_n[2] = {}, sum_x[2] = {}, sum_y[2] = {}, sum_z[2] = {};
  FloatLanes sum_xx[2] = {}, sum_xy[2] = {}, sum_xz[2] = {};
  FloatLanes sum_yy[2] = {}, sum_yz[2] = {}, sum_zz[2] = {};
  for (int begin = 0; begin < pixels; begin += 2 * kLanes) {
    for (int half = 0; half < 2; ++half) {
      const int k = begin + half * kLanes;
      FloatLanes dx, dy, dz;
      load(x + k, dx, dy, dz);
      FloatLanes counts = dx == dx ? one : zero;
      dy = dx == dx ? dy - oy : zero;
      dz = dx == dx ? dz - oz : zero;
      dx = dx == dx ? dx - ox : zero;
      if (labels != nullptr) {
        IntLanes held;
        load(labels + k, held);
        counts = held == label ? counts : zero;
        dx *= counts;
        dy *= counts;
        dz *= counts;
      }
      sum_n[half] += counts;
      sum_x[half] += dx;
      sum_y[half] += dy;
      sum_z[half] += dz;
      sum_xx[half] += dx * dx;
      sum_xy[half] += dx * dy;
      sum_xz[half] += dx * dz;
      sum_yy[half] += dy * dy;
      sum_yz[half] += dy * dz;
      sum_zz[half] += dz * dz;
    }
  }
  const double n = sumOf(sum_n);
  const double cx = ox;
  const double cy = oy;
  const double cz = oz;
  const double sx = sumOf(sum_x);
  const double sy = sumOf(sum_y);
  const double sz = sumOf(sum_z);
  out[kN * out_stride] = n;
  out[kX * out_stride] = sx + n * cx;
  out[kY * out_stride] = sy + n * cy;
  out[kZ * out_stride] = sz + n * cz;
  out[kXX * out_stride] = sumOf(sum_xx) + 2.0 * cx * sx + n * cx * cx;
  out[kXY * out_stride] = sumOf(sum_xy) + cx * sy + cy * sx + n * cx * cy;
  out[kXZ * out_stride] = sumOf(sum_xz) + cx * sz + cz * sx + n * cx * cz;
  out[kYY * out_stride] = sumOf(sum_yy) + 2.0 * cy * sy + n * cy * cy;
  out[kYZ * out_stride] = sumOf(sum_yz) + cy * sz + cz * sy + n * cy * cz;
  out[kZZ * out_stride] = sumOf(sum_zz) + 2.0 * cz * sz + n * cz * cz;
}

PLANAR_MAPPING_MULTIVERSION
void sumRows(const double* in, int columns, int rows, int radius, double* out) {
  for (int row = 0; row < rows; ++row) {
    const int from = row - radius > 0 ? row - radius : 0;
    const int to = row + radius < rows - 1 ? row + radius : rows - 1;
    double* line = out + static_cast<std::size_t>(row) * columns;
    const double* first = in + static_cast<std::size_t>(from) * columns;
    for (int column = 0; column < columns; ++column) line[column] = first[column];
    for (int other = from + 1; other <= to; ++other) {
      const double* add = in + static_cast<std::size_t>(other) * columns;
      for (int column = 0; column < columns; ++column) line[column] += add[column];
    }
  }
}

PLANAR_MAPPING_MULTIVERSION
void sumColumns(double* data, int columns, int rows, int radius, double* padded) {
  // padded: columns + 2 * radius values, zero at both ends.
  for (int row = 0; row < rows; ++row) {
    double* line = data + static_cast<std::size_t>(row) * columns;
    for (int column = 0; column < columns; ++column) padded[radius + column] = line[column];
    for (int column = 0; column < columns; ++column) line[column] = padded[column];
    for (int shift = 1; shift <= 2 * radius; ++shift) {
      for (int column = 0; column < columns; ++column) line[column] += padded[column + shift];
    }
  }
}

/// Of every tile, out[moment * out_stride + tile].
PLANAR_MAPPING_MULTIVERSION
void sumTiles(const float* xyz, int first_tile, int last_tile, std::size_t out_stride,
              double* out) {
  for (int tile = first_tile; tile < last_tile; ++tile) {
    const float* x = xyz + std::size_t{3} * kTileArea * tile;
    sumPixels(x, nullptr, 0, kTileArea, out + tile, out_stride);
  }
}

/// Of every quarter of a row of tiles over the pixels without a label; quarters form a grid of
/// 2 * columns by 2 * rows cells, out[moment * out_stride + cell], which is zero before; most have
/// no such pixel. \param columns tiles in a row
PLANAR_MAPPING_MULTIVERSION
void sumFreeQuarters(const float* xyz, const std::int16_t* labels, int columns, int row,
                     std::size_t out_stride, double* out) {
  for (int column = 0; column < columns; ++column) {
    const std::size_t tile = static_cast<std::size_t>(row) * columns + column;
    const float* x = xyz + 3 * kTileArea * tile;
    const std::int16_t* tile_labels = labels + kTileArea * tile;
    for (int quarter = 0; quarter < 4; ++quarter) {
      const int at = quarter * kQuarterArea;
      const std::size_t cell =
          (static_cast<std::size_t>(2 * row + quarter / 2) * columns + column) * 2 + quarter % 2;
      ShortLanes held;
      std::memcpy(&held, tile_labels + at, sizeof(held));
      if (smallestOf(held) >= 0) continue;
      sumPixels(x + at, tile_labels + at, -1, kQuarterArea, out + cell, out_stride);
    }
  }
}

}  // namespace

TiledCloud tileCloud(const PointsView& points, const Indices* indices, const Vector3& sensor,
                     const StereoNoise* camera, int threads) {
  TiledCloud cloud;
  std::size_t first = 0;
  if (!findOrigin(points, indices, first)) return cloud;
  cloud.width = static_cast<int>(points.width);
  cloud.height = static_cast<int>(points.height);
  cloud.columns = (cloud.width + kTileSide - 1) / kTileSide;
  cloud.rows = (cloud.height + kTileSide - 1) / kTileSide;
  if (!camera) cloud.origin = points.point(first);
  cloud.sensor = sensor - cloud.origin;
  cloud.xyz.reset(new float[std::size_t{3} * kTileArea * cloud.tiles()]);
  const float zero[3] = {0.0F, 0.0F, 0.0F};
  const float* origin = camera ? zero : points[first];
  const auto focal = static_cast<float>(camera ? camera->focal_length : 0.0);
  const auto factor = static_cast<float>(camera ? camera->baseline * camera->focal_length : 0.0);
  parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t row) {
    float* tiles = cloud.xyz.get() + std::size_t{3} * kTileArea * cloud.columns * row;
    if (indices) {
      copyIndexed(points, *indices, origin, static_cast<int>(row), cloud.columns, tiles);
    } else {
      copyTileRow(points, origin, static_cast<int>(row), cloud.columns, tiles);
    }
    if (camera) toDisparities(focal, factor, cloud.columns, tiles);
  });
  return cloud;
}

PLANAR_MAPPING_MULTIVERSION
void sumLabelledPixels(const float* x, const std::int16_t* labels, std::int16_t label,
                       double* out) {
  sumPixels(x, labels, label, kTileArea, out, 1);
}

PLANAR_MAPPING_MULTIVERSION
void sumQuarters(const float* xyz, int columns, double* out) {
  for (int column = 0; column < columns; ++column) {
    const float* x = xyz + std::size_t{3} * kTileArea * column;
    for (int quarter = 0; quarter < 4; ++quarter) {
      const std::size_t cell = static_cast<std::size_t>(quarter / 2 * columns + column) * 2;
      const float* at = x + quarter * kQuarterArea;
      sumPixels(at, nullptr, 0, kQuarterArea, out + (cell + quarter % 2) * kMoments, 1);
    }
  }
}

CellGrid tileGrid(const TiledCloud& cloud, int threads) {
  CellGrid grid(cloud.columns, cloud.rows, kTileArea);
  parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t row) {
    const int first = static_cast<int>(row) * cloud.columns;
    sumTiles(cloud.xyz.get(), first, first + cloud.columns, static_cast<std::size_t>(grid.cells()),
             grid.sums.data());
  });
  return grid;
}

CellGrid freeQuarterGrid(const TiledCloud& cloud, const std::vector<std::int16_t>& labels,
                         int threads) {
  CellGrid grid(2 * cloud.columns, 2 * cloud.rows, kQuarterArea);
  std::fill(grid.sums.begin(), grid.sums.end(), 0.0);
  parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t row) {
    sumFreeQuarters(cloud.xyz.get(), labels.data(), cloud.columns, static_cast<int>(row),
                    static_cast<std::size_t>(grid.cells()), grid.sums.data());
  });
  return grid;
}

CellGrid windowSums(const CellGrid& grid, int radius, int moments) {
  CellGrid windows(grid.columns, grid.rows, grid.capacity * (2 * radius + 1) * (2 * radius + 1));
  std::vector<double> padded(static_cast<std::size_t>(grid.columns + 2 * radius), 0.0);
  for (int m = 0; m < moments; ++m) {
    sumRows(grid.moment(m), grid.columns, grid.rows, radius, windows.moment(m));
    sumColumns(windows.moment(m), grid.columns, grid.rows, radius, padded.data());
  }
  return windows;
}

MomentSums sumWindow(const CellGrid& grid, int cell, int radius) {
  const int row = cell / grid.columns;
  const int column = cell % grid.columns;
  const int top = std::max(0, row - radius);
  const int left = std::max(0, column - radius);
  const int rows = std::min(grid.rows - 1, row + radius) - top + 1;
  const int columns = std::min(grid.columns - 1, column + radius) - left + 1;
  const std::size_t first = static_cast<std::size_t>(top) * grid.columns + left;
  MomentSums sums;
  for (int m = 0; m < kMoments; ++m) {
    const double* line = grid.moment(m) + first;
    double window = 0.0;
    for (int c = 0; c < columns; ++c) {
      double sum = line[c];
      for (int r = 1; r < rows; ++r) sum += line[r * grid.columns + c];
      window += sum;
    }
    sums[static_cast<std::size_t>(m)] = window;
  }
  return sums;
}

}  // namespace planar_mapping::detail
