// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/rest_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "grid/cell_numbering.h"
#include "planar_mapping/core/base/detail/simd.h"
#include "cuboids/raster_kernels.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kChunk = 4096;
static_assert(kChunk % kKernelBlock == 0);
/// Beyond this cell number floats are coarser than the grid for every resolution we accept.
constexpr std::int32_t kLargestCell = 1 << 29;
constexpr std::int32_t kNoCell = std::numeric_limits<std::int32_t>::min();

/// Cells of a stretch of points of side 1 / cells_per_metre.
struct ChunkOfCells {
  std::vector<std::int32_t> x = std::vector<std::int32_t>(kChunk);
  std::vector<std::int32_t> y = std::vector<std::int32_t>(kChunk);
  std::vector<std::int32_t> z = std::vector<std::int32_t>(kChunk);

  bool isPlaced(std::size_t i) const { return x[i] != kNoCell; }
  CellKey operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
};

/// Calls visit(position of the first, number of points, their cells) for each stretch.
template <typename Visit>
void forEachChunk(const PointsView& points, const Indices* indices, double cells_per_metre,
                  const Visit& visit) {
  const std::size_t size = indices ? indices->size() : points.size;
  ChunkOfCells cells;
  for (std::size_t first = 0; first < size; first += kChunk) {
    const std::size_t some = std::min(kChunk, size - first);
    PointSelection selection{points.data, points.stride, nullptr, some};
    if (indices) {
      selection.indices = indices->data() + first;
    } else {
      selection.data += first * points.stride;
    }
    gridCells(selection, cells_per_metre, kLargestCell, cells.x.data(), cells.y.data(),
              cells.z.data());
    visit(first, some, cells);
  }
}

/// Where points begin that are in another cell than the one before; the first point does.
/// \param changes room for \p n marks
/// \param begins  room for \p n positions
PLANAR_MAPPING_MULTIVERSION
std::size_t findRuns(const std::int32_t* x, const std::int32_t* y, const std::int32_t* z,
                     std::size_t n, std::uint8_t* changes, std::uint16_t* begins) {
  changes[0] = 1;
  for (std::size_t i = 1; i < n; ++i) {
    changes[i] = ((x[i] ^ x[i - 1]) | (y[i] ^ y[i - 1]) | (z[i] ^ z[i - 1])) != 0 ? 1 : 0;
  }
  std::size_t runs = 0;
  for (std::size_t i = 0; i < n; ++i) {  // where they are no branch could foresee
    begins[runs] = static_cast<std::uint16_t>(i);
    runs += changes[i];
  }
  return runs;
}

CellKey cellOf(const CellKey& half) {
  return {half[0] >> 1, half[1] >> 1, half[2] >> 1};
}

// Not operator==, which calls memcmp.
bool isSame(const CellKey& l, const CellKey& r) {
  return ((l[0] ^ r[0]) | (l[1] ^ r[1]) | (l[2] ^ r[2])) == 0;
}

/// Sums over the points of a cell, about the cell's corner.
struct CellSums {
  CellKey cell{};
  std::uint32_t count = 0;
  std::uint8_t octants = 0;
  double probability = 0.0;
  Vector3 sum = Vector3::Zero();
};

}  // namespace

RestCells collectRest(const PointsView& points, const Indices* indices, double resolution,
                      const PlanarVolume* volume, const std::vector<float>* probability) {
  RestCells rest;
  CellNumbering numbers;
  std::vector<CellSums> sums;
  std::vector<std::size_t> first_candidate;  // of cell i: candidates[first[i]] ...
  std::vector<std::int32_t> candidates;
  const double radius = 0.5 * std::sqrt(3.0) * resolution;
  const auto addPoint = [&](std::size_t index, const CellKey& half, std::size_t number) {
    const Vector3 p = points.point(index);
    const std::size_t last =
        number + 1 < first_candidate.size() ? first_candidate[number + 1] : candidates.size();
    for (std::size_t k = first_candidate[number]; k < last; ++k) {
      if (!volume->contains(candidates[k], p)) continue;
      ++rest.absorbed;
      return;
    }
    CellSums& sum = sums[number];
    ++sum.count;
    sum.octants |=
        static_cast<std::uint8_t>(1u << ((half[0] & 1) + 2 * (half[1] & 1) + 4 * (half[2] & 1)));
    sum.sum += p - resolution * Vector3(sum.cell[0], sum.cell[1], sum.cell[2]);
    sum.probability += probability ? (*probability)[index] : 1.0f;
  };
  // Half cells, because it matters as well which part of a cell is in use.
  const auto addChunk = [&](std::size_t first, std::size_t size, const ChunkOfCells& halves) {
    std::size_t number = 0;
    CellKey last{kNoCell, kNoCell, kNoCell};  // no half of it: those are smaller
    for (std::size_t i = 0; i < size; ++i) {
      if (!halves.isPlaced(i)) continue;
      ++rest.points;
      const CellKey half = halves[i];
      const CellKey cell = cellOf(half);
      if (!isSame(cell, last)) {
        last = cell;
        number = static_cast<std::size_t>(numbers.insert(cell));
        if (number == sums.size()) {
          sums.emplace_back();
          sums.back().cell = cell;
          first_candidate.push_back(candidates.size());
          const Vector3 center = resolution * (Vector3(cell[0], cell[1], cell[2]).array() + 0.5);
          if (volume) volume->candidates(center, radius, candidates);
        }
      }
      addPoint(indices ? static_cast<std::size_t>((*indices)[first + i]) : first + i, half, number);
    }
  };
  forEachChunk(points, indices, 2.0 / resolution, addChunk);
  rest.dropped = (indices ? indices->size() : points.size) - rest.points;
  rest.cells.reserve(sums.size());
  for (const CellSums& sum : sums) {
    NonPlanarCell cell;  // without octants where all points were absorbed: boxes may still use it
    cell.x = sum.cell[0];
    cell.y = sum.cell[1];
    cell.z = sum.cell[2];
    cell.mean = resolution * Vector3(cell.x, cell.y, cell.z) + sum.sum / std::max(1u, sum.count);
    cell.weight = static_cast<float>(sum.count);
    cell.probability = static_cast<float>(sum.probability / std::max(1u, sum.count));
    cell.octants = sum.octants;
    rest.cells.push_back(cell);
  }
  return rest;
}

std::size_t countCells(const PointsView& points, const Indices* indices, double resolution) {
  // Noise moves points to and fro between cells, but seldom between blocks of 4 x 4 x 4 of them.
  CellNumbering numbers;
  std::vector<std::uint64_t> blocks;
  std::vector<std::uint8_t> changes(kChunk);
  std::vector<std::uint16_t> begins(kChunk);
  forEachChunk(points, indices, 1.0 / resolution,
               [&](std::size_t, std::size_t size, const ChunkOfCells& cells) {
                 std::uint64_t bits = 0;  // of the block of the last point
                 CellKey last{kNoCell, kNoCell, kNoCell};
                 const auto store = [&] {
                   if (bits == 0) return;
                   const auto number = static_cast<std::size_t>(numbers.insert(last));
                   if (number == blocks.size()) blocks.push_back(0);
                   blocks[number] |= std::exchange(bits, 0);
                 };
                 const std::size_t runs = findRuns(cells.x.data(), cells.y.data(), cells.z.data(),
                                                   size, changes.data(), begins.data());
                 for (std::size_t r = 0; r < runs; ++r) {
                   if (!cells.isPlaced(begins[r])) continue;
                   const CellKey c = cells[begins[r]];
                   const CellKey block{c[0] >> 2, c[1] >> 2, c[2] >> 2};
                   if (!isSame(block, last)) {
                     store();
                     last = block;
                   }
                   bits |= std::uint64_t{1} << ((c[0] & 3) + 4 * (c[1] & 3) + 16 * (c[2] & 3));
                 }
                 store();
               });
  std::size_t count = 0;
  for (const std::uint64_t block : blocks) {
    count += static_cast<std::size_t>(__builtin_popcountll(block));
  }
  return count;
}

}  // namespace planar_mapping::detail
