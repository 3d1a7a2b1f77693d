// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "frame_cells.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {
namespace {

// Cells are counted from the sensor, so that floats are exact enough anywhere in the world.
constexpr std::int32_t kFarthest = 1 << 20;
constexpr std::size_t kFewestSlots = 1024;
constexpr std::size_t kBlock = 512;
constexpr std::uint64_t kPart = 0x1FFFFFu;  // 21 bits an axis

void gather(const float* points, std::size_t stride, const int* indices, std::size_t n, float* x,
            float* y, float* z) {
  for (std::size_t k = 0; k < n; ++k) {
    const float* p = points + static_cast<std::size_t>(indices[k]) * stride;
    x[k] = p[0];
    y[k] = p[1];
    z[k] = p[2];
  }
}

/// Cell numbers of points along one axis, -kFarthest where too far or not a number.
PLANAR_MAPPING_MULTIVERSION
void cellsAlongAxis(const float* __restrict x, const float* __restrict y, const float* __restrict z,
                    std::size_t n, const float* row, float offset,
                    std::int32_t* __restrict numbers) {
  constexpr auto kLimit = static_cast<float>(kFarthest - 1);
  const float a = row[0];
  const float b = row[1];
  const float c = row[2];
  for (std::size_t k = 0; k < n; ++k) {
    const float cell = std::floor(a * x[k] + b * y[k] + c * z[k] + offset);
    numbers[k] = static_cast<std::int32_t>(std::fabs(cell) < kLimit ? cell : -kLimit - 1.0f);
  }
}

}  // namespace

void FrameCells::number(const PointsView& points, const Indices& indices,
                        const std::vector<std::int32_t>& labels, const Pose& T_world_sensor,
                        double resolution) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < 3; ++i) {
      rows_[axis][i] = static_cast<float>(T_world_sensor.linear()(axis, i) / resolution);
    }
    const double shift = T_world_sensor.translation()[axis] / resolution;
    const double whole = std::floor(shift);
    offset_[axis] = static_cast<float>(shift - whole);
    constexpr double kBeyond = 1e15;
    origin_[axis] = std::abs(whole) < kBeyond ? static_cast<std::int64_t>(whole) : 0;
  }
  groups_.clear();
  std::fill(slots_.begin(), slots_.end(), Slot());
  group_of_point_.resize(indices.size());
  std::int32_t numbers[3][kBlock];
  float x_of[kBlock];
  float y_of[kBlock];
  float z_of[kBlock];
  // Neighbouring points are mostly in the same cell.
  std::int32_t last[3] = {INT32_MIN, 0, 0};
  std::int32_t last_label = -1;
  std::int32_t last_group = -1;
  for (std::size_t first = 0; first < indices.size(); first += kBlock) {
    const std::size_t n = std::min(kBlock, indices.size() - first);
    gather(points.data, points.stride, indices.data() + first, n, x_of, y_of, z_of);
    for (int axis = 0; axis < 3; ++axis) {
      cellsAlongAxis(x_of, y_of, z_of, n, rows_[axis], offset_[axis], numbers[axis]);
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::int32_t label = labels[static_cast<std::size_t>(indices[first + k])];
      const std::int32_t x = numbers[0][k];
      const std::int32_t y = numbers[1][k];
      const std::int32_t z = numbers[2][k];
      if (x != last[0] || y != last[1] || z != last[2] || label != last_label) {
        last[0] = x;
        last[1] = y;
        last[2] = z;
        last_label = label;
        last_group = -1;
        if (x > -kFarthest && y > -kFarthest && z > -kFarthest) {
          const std::uint64_t cell = ((static_cast<std::uint64_t>(x + origin_[0]) & kPart) << 42u) |
                                     ((static_cast<std::uint64_t>(y + origin_[1]) & kPart) << 21u) |
                                     (static_cast<std::uint64_t>(z + origin_[2]) & kPart);
          last_group = insert(cell, label);
        }
      }
      group_of_point_[first + k] = last_group;
    }
  }
}

std::uint64_t FrameCells::cellOf(const Vector3& point) const {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float* row = rows_[axis];
    const float cell =
        std::floor(row[0] * static_cast<float>(point.x()) + row[1] * static_cast<float>(point.y()) +
                   row[2] * static_cast<float>(point.z()) + offset_[axis]);
    if (!(std::fabs(cell) < static_cast<float>(kFarthest - 1))) return kNoCell;
    key = (key << 21u) |
          (static_cast<std::uint64_t>(static_cast<std::int64_t>(cell) + origin_[axis]) & kPart);
  }
  return key;
}

std::uint64_t FrameCells::beside(std::uint64_t cell, int dx, int dy, int dz) {
  const auto part = [cell](unsigned shift, int step) {
    return (((cell >> shift) + static_cast<std::uint64_t>(static_cast<std::int64_t>(step))) & kPart)
           << shift;
  };
  return part(42u, dx) | part(21u, dy) | part(0u, dz);
}

std::size_t FrameCells::slotOf(std::uint64_t cell, std::int32_t label) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t at = hashSlot(cell + static_cast<std::uint64_t>(label), mask);
  while (slots_[at].number >= 0 && !(slots_[at].cell == cell && slots_[at].label == label)) {
    at = (at + 1) & mask;
  }
  return at;
}

std::int32_t FrameCells::insert(std::uint64_t cell, std::int32_t label) {
  if (2 * (groups_.size() + 1) > slots_.size()) grow();
  Slot& slot = slots_[slotOf(cell, label)];
  if (slot.number < 0) {
    slot = {cell, label, static_cast<std::int32_t>(groups_.size())};
    groups_.push_back({cell, label});
  }
  return slot.number;
}

std::int32_t FrameCells::find(std::uint64_t cell, std::int32_t label) const {
  return slots_.empty() ? -1 : slots_[slotOf(cell, label)].number;
}

void FrameCells::grow() {
  slots_.assign(std::max(kFewestSlots, 2 * slots_.size()), Slot());
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    slots_[slotOf(groups_[g].cell, groups_[g].label)] = {groups_[g].cell, groups_[g].label,
                                                         static_cast<std::int32_t>(g)};
  }
}

}  // namespace planar_mapping::detail
