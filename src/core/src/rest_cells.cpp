// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "rest_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cell_index.h"
#include "raster_kernels.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kChunk = 4096;
/// Beyond this cell number floats are coarser than the grid for every resolution we accept.
constexpr std::int32_t kLargestCell = 1 << 29;
constexpr std::int32_t kNoCell = std::numeric_limits<std::int32_t>::min();

/// Calls visit(position in the selection, half cell as key) for each point that has a cell, in
/// order. Half cells, because which part of a cell is in use matters as well.
template <typename Visit>
void forEachHalfCell(const PointsView& points, const Indices* indices, double resolution,
                     const Visit& visit) {
  const std::size_t size = indices ? indices->size() : points.size;
  std::vector<std::int32_t> x(kChunk), y(kChunk), z(kChunk);
  for (std::size_t first = 0; first < size; first += kChunk) {
    const std::size_t some = std::min(kChunk, size - first);
    PointSelection selection{points.data, points.stride, nullptr, some};
    if (indices) {
      selection.indices = indices->data() + first;
    } else {
      selection.data += first * points.stride;
    }
    gridCells(selection, 2.0 / resolution, 2 * kLargestCell, x.data(), y.data(), z.data());
    for (std::size_t i = 0; i < some; ++i) {
      if (x[i] != kNoCell) visit(first + i, CellKey{x[i], y[i], z[i]});
    }
  }
}

CellKey cellOf(const CellKey& half) {
  return {half[0] >> 1, half[1] >> 1, half[2] >> 1};
}

/// Numbers cells; neighbours in the cloud mostly share one, so the last answer is kept.
class CellNumbers {
 public:
  std::int32_t operator()(const CellKey& cell) {
    if (last_ >= 0 && cell == last_cell_) return last_;
    last_cell_ = cell;
    last_ = index_.insert(cell);
    return last_;
  }
  std::size_t size() const { return index_.size(); }

 private:
  CellIndex index_;
  CellKey last_cell_{};
  std::int32_t last_ = -1;
};

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
  CellNumbers numbers;
  std::vector<CellSums> sums;
  std::vector<std::size_t> first_candidate;  // of cell i: candidates[first[i]] ...
  std::vector<std::int32_t> candidates;
  const double radius = 0.5 * std::sqrt(3.0) * resolution;
  forEachHalfCell(points, indices, resolution, [&](std::size_t position, const CellKey& half) {
    const CellKey cell = cellOf(half);
    const auto number = static_cast<std::size_t>(numbers(cell));
    const Vector3 corner = resolution * Vector3(cell[0], cell[1], cell[2]);
    if (number == sums.size()) {
      sums.emplace_back();
      sums.back().cell = cell;
      first_candidate.push_back(candidates.size());
      if (volume) volume->candidates(corner.array() + 0.5 * resolution, radius, candidates);
    }
    ++rest.points;
    const std::size_t index = indices ? static_cast<std::size_t>((*indices)[position]) : position;
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
    sum.sum += p - corner;
    sum.probability += probability ? (*probability)[index] : 1.0f;
  });
  rest.dropped = (indices ? indices->size() : points.size) - rest.points;
  rest.cells.reserve(sums.size());
  for (const CellSums& sum : sums) {
    if (sum.count == 0) continue;
    NonPlanarCell cell;
    cell.x = sum.cell[0];
    cell.y = sum.cell[1];
    cell.z = sum.cell[2];
    cell.mean = resolution * Vector3(cell.x, cell.y, cell.z) + sum.sum / sum.count;
    cell.weight = static_cast<float>(sum.count);
    cell.probability = static_cast<float>(sum.probability / sum.count);
    cell.octants = sum.octants;
    rest.cells.push_back(cell);
  }
  return rest;
}

std::size_t countCells(const PointsView& points, const Indices* indices, double resolution) {
  CellNumbers numbers;
  forEachHalfCell(points, indices, resolution,
                  [&](std::size_t, const CellKey& half) { numbers(cellOf(half)); });
  return numbers.size();
}

}  // namespace planar_mapping::detail
