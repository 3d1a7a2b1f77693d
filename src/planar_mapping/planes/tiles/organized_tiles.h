// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "planar_mapping/base/organized_lanes.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping::detail {

constexpr int kTileSide = 8;                      ///< pixels
constexpr int kQuarterSide = 4;                   ///< pixels
constexpr int kTileArea = kTileSide * kTileSide;  ///< pixels
constexpr int kQuarterArea = kTileArea / 4;       ///< pixels

/// Place of pixel (row, column) of a tile: the four 4 x 4 quarters lie one after the other, so
/// that a quarter is one vector of 16 floats and a tile four of them.
constexpr int pixelInTile(int row, int column) {
  return ((row / kQuarterSide) * 2 + column / kQuarterSide) * kQuarterArea +
         (row % kQuarterSide) * kQuarterSide + column % kQuarterSide;
}

/// x, y and z of the pixels of a tile that begin at this x.
PLANAR_MAPPING_INLINE void load(const float* from, FloatLanes& x, FloatLanes& y, FloatLanes& z) {
  load(from, x);
  load(from + kTileArea, y);
  load(from + 2 * kTileArea, z);
}

/// An organized cloud cut into 8 x 8 pixel tiles, each 64 x, then 64 y, then 64 z, relative to
/// `origin`. Pixels that do not count (non-finite, not indexed, beyond the border) are NaN in all
/// three. Every later pass reads contiguous memory, whatever the point type of the cloud was.
struct TiledCloud {
  int width = 0;                     ///< pixels
  int height = 0;                    ///< pixels
  int columns = 0;                   ///< tiles
  int rows = 0;                      ///< tiles
  Vector3 origin = Vector3::Zero();  ///< first finite point, metres
  Vector3 sensor = Vector3::Zero();  ///< relative to origin, metres
  std::unique_ptr<float[]> xyz;

  int tiles() const { return columns * rows; }
  const float* x(int tile) const { return xyz.get() + std::size_t{3} * kTileArea * tile; }
  const float* y(int tile) const { return x(tile) + kTileArea; }
  const float* z(int tile) const { return x(tile) + 2 * kTileArea; }
};

/// \param indices the points that count, ascending, or null for all
/// \param camera  null for points in metres; else x, y and z become column f x / z, row f y / z and
///                disparity B f / z in pixels about the principal point, and the origin is zero.
///                Points that are not in front of the camera then do not count.
/// \return without tiles if no point is finite
TiledCloud tileCloud(const PointsView& points, const Indices* indices, const Vector3& sensor,
                     const StereoNoise* camera, int threads);

/// Number, sums and products of points, metres about the origin of the tiled cloud.
enum Moment { kN, kX, kY, kZ, kXX, kXY, kXZ, kYY, kYZ, kZZ, kMoments };
using MomentSums = std::array<double, kMoments>;

// Sums of the points of tiled clouds; \p xyz is TiledCloud::xyz, \p x that of one tile.

/// Of all pixels of every quarter in a row of tiles, two rows of 2 * columns cells.
void sumQuarters(const float* xyz, int columns, double* out);

/// Of the pixels of a tile that carry \p label; \p labels are those of the tile.
void sumLabelledPixels(const float* x, const std::int16_t* labels, std::int16_t label, double* out);

/// Leaves the elements of a new vector as they are, where all are written anyway.
template <typename T>
struct Unset : std::allocator<T> {
  using std::allocator<T>::allocator;
  template <typename U>
  struct rebind {
    using other = Unset<U>;
  };
  template <typename U>
  void construct(U* at) {
    ::new (static_cast<void*>(at)) U;
  }
  template <typename U, typename... Values>
  void construct(U* at, Values&&... values) {
    ::new (static_cast<void*>(at)) U(std::forward<Values>(values)...);
  }
};

/// A grid of cells, each the sums of its points, about the origin of the tiled cloud.
struct CellGrid {
  int columns;
  int rows;
  int capacity;                             ///< points of a full cell
  std::vector<double, Unset<double>> sums;  ///< moment * cells + cell; not set at first

  CellGrid(int columns_, int rows_, int capacity_)
      : columns(columns_),
        rows(rows_),
        capacity(capacity_),
        sums(static_cast<std::size_t>(kMoments) * cells()) {}
  int cells() const { return columns * rows; }
  const double* moment(int m) const { return sums.data() + static_cast<std::size_t>(m) * cells(); }
  double* moment(int m) { return sums.data() + static_cast<std::size_t>(m) * cells(); }
  double count(int cell) const { return sums[static_cast<std::size_t>(cell)]; }
  void set(std::size_t cell, const MomentSums& to) {
    for (int m = 0; m < kMoments; ++m) moment(m)[cell] = to[static_cast<std::size_t>(m)];
  }
};

CellGrid tileGrid(const TiledCloud& cloud, int threads);
CellGrid freeQuarterGrid(const TiledCloud& cloud, const std::vector<std::int16_t>& labels,
                         int threads);

/// Sums over the (2 radius + 1)^2 cells around each cell, of the first moments.
CellGrid windowSums(const CellGrid& grid, int radius, int moments = kMoments);

/// Sums over the (2 radius + 1)^2 cells around one cell.
MomentSums sumWindow(const CellGrid& grid, int cell, int radius);

inline void addSums(MomentSums& sums, const MomentSums& other) {
  for (std::size_t m = 0; m < kMoments; ++m) sums[m] += other[m];
}
inline MomentSums sumsOf(const CellGrid& grid, int cell) {
  MomentSums sums;
  for (int m = 0; m < kMoments; ++m) sums[static_cast<std::size_t>(m)] = grid.moment(m)[cell];
  return sums;
}
inline Vector3 meanOf(const MomentSums& sums) {
  return Vector3(sums[kX], sums[kY], sums[kZ]) / sums[kN];
}
inline Vector3 meanOf(const CellGrid& grid, int cell) {
  return Vector3(grid.moment(kX)[cell], grid.moment(kY)[cell], grid.moment(kZ)[cell]) /
         grid.count(cell);
}

}  // namespace planar_mapping::detail
