// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "grid/labelled_cells.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/core/base/error.h"
#include "base/point_indices.h"

namespace planar_mapping::detail {
namespace {

std::uint64_t mix(std::uint64_t h, std::int32_t value) {
  h = (h ^ static_cast<std::uint32_t>(value)) * 0x9E3779B97F4A7C15ULL;
  return h ^ (h >> 29u);
}

/// False if the point is not finite or too far away to be counted in cells.
bool cellOf(const float* point, double resolution, LabelledCell& cell) {
  constexpr double kFarthest = 1 << 30;
  const double x = std::floor(point[0] / resolution);
  const double y = std::floor(point[1] / resolution);
  const double z = std::floor(point[2] / resolution);
  if (!(std::abs(x) < kFarthest && std::abs(y) < kFarthest && std::abs(z) < kFarthest)) {
    return false;
  }
  cell.x = static_cast<std::int32_t>(x);
  cell.y = static_cast<std::int32_t>(y);
  cell.z = static_cast<std::int32_t>(z);
  return true;
}

}  // namespace

LabelledCells::LabelledCells() : slots_(1024, -1) {}

std::size_t LabelledCells::slotOf(const LabelledCell& cell) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = mix(mix(mix(mix(0, cell.x), cell.y), cell.z), cell.label) & mask;
  while (slots_[slot] >= 0 && !(cells_[slots_[slot]] == cell)) slot = (slot + 1) & mask;
  return slot;
}

std::int32_t LabelledCells::insert(const LabelledCell& cell) {
  std::size_t slot = slotOf(cell);
  if (slots_[slot] >= 0) return slots_[slot];
  if (2 * (cells_.size() + 1) > slots_.size()) {
    grow();
    slot = slotOf(cell);
  }
  slots_[slot] = static_cast<std::int32_t>(cells_.size());
  cells_.push_back(cell);
  return slots_[slot];
}

std::int32_t LabelledCells::find(const LabelledCell& cell) const {
  return slots_[slotOf(cell)];
}

void LabelledCells::grow() {
  std::vector<std::int32_t>(2 * slots_.size(), -1).swap(slots_);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    slots_[slotOf(cells_[i])] = static_cast<std::int32_t>(i);
  }
}

std::vector<std::int32_t> numberCells(const PointsView& points, const Indices* indices,
                                      const std::vector<std::int32_t>* labels, double resolution,
                                      LabelledCells& cells) {
  requirePositive("resolution", resolution, "m");
  requireIndices(points, indices);
  if (labels && labels->size() != points.size) {
    throw InputError("labels: " + std::to_string(labels->size()) + " values for a cloud of " +
                     std::to_string(points.size) + " points");
  }
  const std::size_t n = countOf(points, indices);
  std::vector<std::int32_t> number(n, -1);
  LabelledCell cell;
  LabelledCell last;
  std::int32_t last_number = -1;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = at(indices, k);
    if (!cellOf(points[i], resolution, cell)) continue;
    cell.label = labels ? std::max((*labels)[i], -1) : -1;
    // Neighbours in a scan mostly share a cell.
    if (last_number < 0 || !(cell == last)) {
      last_number = cells.insert(cell);
      last = cell;
    }
    number[k] = last_number;
  }
  return number;
}

}  // namespace planar_mapping::detail
