// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planes/tiles/organized_cells.h"

#include <algorithm>

#include "planar_mapping/core/base/detail/parallel.h"
#include "planar_mapping/core/base/detail/simd.h"

namespace planar_mapping::detail {
namespace {

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

}  // namespace

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
  parallelFor(static_cast<std::size_t>(cloud.rows), threads, [&](std::size_t row) {
    const int first = static_cast<int>(row);
    sumFreeQuarters(cloud.xyz.get(), labels.data(), cloud.columns, first, first + 1,
                    static_cast<std::size_t>(grid.cells()), grid.sums.data());
  });
  return grid;
}

CellGrid windowSums(const CellGrid& grid, int radius) {
  CellGrid windows(grid.columns, grid.rows, grid.capacity * (2 * radius + 1) * (2 * radius + 1));
  std::vector<double> padded(static_cast<std::size_t>(grid.columns + 2 * radius), 0.0);
  for (int m = 0; m < kMoments; ++m) {
    sumRows(grid.moment(m), grid.columns, grid.rows, radius, windows.moment(m));
    sumColumns(windows.moment(m), grid.columns, grid.rows, radius, padded.data());
  }
  return windows;
}

/// The window of \p columns by \p rows cells from \p first on. Inlined with sides that are known,
/// it has no loops.
PLANAR_MAPPING_INLINE void sumCells(const CellGrid& grid, std::size_t first, int columns, int rows,
                                    MomentSums& sums) {
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
  if (columns == 3 && rows == 3) {
    sumCells(grid, first, 3, 3, sums);
  } else {
    sumCells(grid, first, columns, rows, sums);
  }
  return sums;
}

}  // namespace planar_mapping::detail
