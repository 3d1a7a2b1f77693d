// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/grid/frame_cells.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/base/gather_points.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

// Cells are counted from the sensor, so that floats are exact enough anywhere in the world.
constexpr std::int32_t kFarthest = 1 << 20;
constexpr std::size_t kMinSlots = 1024;
constexpr std::size_t kBlock = 512;

/// 1 where a number differs from the one before it.
PLANAR_MAPPING_MULTIVERSION
void markChanges(const std::int32_t* numbers, std::size_t n, std::uint8_t* __restrict changed) {
  for (std::size_t k = 0; k < n; ++k) changed[k] |= numbers[k] != numbers[k + 1] ? 1 : 0;
}

/// Cell numbers of at most kBlock points along one axis, -kFarthest where too far or not a number.
PLANAR_MAPPING_MULTIVERSION
void cellsAlongAxis(const float* __restrict x, const float* __restrict y, const float* __restrict z,
                    std::size_t n, const float* row, float offset,
                    std::int32_t* __restrict numbers) {
  constexpr auto kLimit = static_cast<float>(kFarthest - 1);
  const float a = row[0];
  const float b = row[1];
  const float c = row[2];
  // Two loops, and no std::floor(): otherwise neither is vectorised.
  float cells[kBlock];
  for (std::size_t k = 0; k < n; ++k) {
    const float cell = a * x[k] + b * y[k] + c * z[k] + offset;
    cells[k] = (cell >= 1.0f - kLimit) & (cell < kLimit) ? cell : -kLimit - 1.0f;
  }
  for (std::size_t k = 0; k < n; ++k) {
    const auto towards_zero = static_cast<std::int32_t>(cells[k]);
    numbers[k] = towards_zero - (static_cast<float>(towards_zero) > cells[k] ? 1 : 0);
  }
}

}  // namespace

void FrameCells::number(const PointsView& points, const Indices& indices,
                        const std::vector<std::int32_t>& labels, const Pose& T_world_sensor,
                        double resolution, int threads) {
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
  runs_.clear();
  std::fill(slots_.begin(), slots_.end(), Slot());
  hints_.fill(0);
  // Where cells begin is found in stretches, their numbers are given in order: by one thread each
  // time at once, so that what is found stays in the first cache.
  constexpr std::size_t kStretch = 1 << 12;
  const std::size_t stretches = (indices.size() + kStretch - 1) / kStretch;
  const std::size_t at_once = resolveThreads(threads) > 1 ? stretches : 1;
  starts_.resize(std::max(starts_.size(), at_once));
  std::int32_t group = -1;
  for (std::size_t first = 0; first < stretches; first += at_once) {
    parallelFor(at_once, threads, [&](std::size_t i) {
      const std::size_t begin = (first + i) * kStretch;
      starts_[i].clear();
      findStarts(points, indices, labels, begin, std::min(begin + kStretch, indices.size()),
                 starts_[i]);
    });
    for (std::size_t i = 0; i < at_once; ++i) {
      // Room for as many runs in the rest as in the stretches so far: to double it takes too much.
      const std::size_t runs = runs_.size() + starts_[i].size();
      const std::size_t all = std::min((runs * stretches) / (first + i + 1), indices.size());
      if (runs > runs_.capacity()) runs_.reserve(std::max(runs + runs / 8, all + 1));
      group = addRuns(starts_[i], group);
    }
  }
  if (!indices.empty()) runs_.push_back({static_cast<std::uint32_t>(indices.size()), group});
}

/// Of the indices [first, last), the first of which begins a run.
void FrameCells::findStarts(const PointsView& points, const Indices& indices,
                            const std::vector<std::int32_t>& labels, std::size_t first,
                            std::size_t last, std::vector<Start>& starts) const {
  float x_of[kBlock];
  float y_of[kBlock];
  float z_of[kBlock];
  // Cell numbers and labels of a block, after those of the last point before it.
  std::int32_t number[3][kBlock + 1];
  std::int32_t label[kBlock + 1];
  number[0][0] = INT32_MIN;  // of no cell
  number[1][0] = number[2][0] = label[0] = 0;
  for (; first < last; first += kBlock) {
    const std::size_t n = std::min(kBlock, last - first);
    gatherPoints(points.data, points.stride, indices.data() + first, n, x_of, y_of, z_of);
    for (std::size_t k = 0; k < n; ++k)
      label[k + 1] = labels[static_cast<std::size_t>(indices[first + k])];
    for (int axis = 0; axis < 3; ++axis) {
      cellsAlongAxis(x_of, y_of, z_of, n, rows_[axis], offset_[axis], number[axis] + 1);
    }
    std::uint8_t changed[kBlock] = {};
    for (const std::int32_t* numbers : {number[0], number[1], number[2], label})
      markChanges(numbers, n, changed);
    for (std::size_t k = 1; k <= n; ++k) {
      if (changed[k - 1] == 0) continue;
      starts.push_back({static_cast<std::uint32_t>(first + k - 1),
                        {number[0][k], number[1][k], number[2][k]},
                        label[k]});
    }
    for (std::int32_t* numbers : {number[0], number[1], number[2], label}) numbers[0] = numbers[n];
  }
}

/// Ends a run where the next one starts.
/// \param group of the run before the first start
/// \return that of the last one
std::int32_t FrameCells::addRuns(const std::vector<Start>& starts, std::int32_t group) {
  const std::size_t before = runs_.size();
  runs_.resize(before + starts.size());
  Run* run = runs_.data() + before;
  for (const Start& start : starts) {
    const std::int32_t next = groupOf(start);
    *run = {start.at, group};
    run += start.at > 0 ? 1 : 0;  // no run ends where the first one starts
    group = next;
  }
  runs_.resize(static_cast<std::size_t>(run - runs_.data()));
  return group;
}

std::int32_t FrameCells::groupOf(const Start& start) {
  std::uint64_t cell = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (start.number[axis] <= -kFarthest) return -1;
    cell = (cell << 21u) | (static_cast<std::uint64_t>(start.number[axis] + origin_[axis]) & kPart);
  }
  return insert(cell, start.label);
}

void FrameCells::giveToPoints(const Indices& indices, const std::vector<float>& of_group,
                              float otherwise, std::vector<float>& values) const {
  // Four points at a time: what belongs to the next runs is given their values after that.
  constexpr std::size_t kAtOnce = 4;
  float* of_point = values.data();
  const int* at = indices.data();
  std::size_t k = 0;
  for (const Run& run : runs_) {
    const float value = run.group < 0 ? otherwise : of_group[static_cast<std::size_t>(run.group)];
    for (; k < run.end && k + kAtOnce <= indices.size(); k += kAtOnce) {
      for (std::size_t i = k; i < k + kAtOnce; ++i) of_point[at[i]] = value;
    }
    for (; k < run.end; ++k) of_point[at[k]] = value;
    k = run.end;
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

std::size_t FrameCells::slotOf(std::uint64_t cell, std::int32_t label) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t at = hashOfGroup(cell, label) & mask;
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
    const std::uint64_t hint = hashOfGroup(cell, label) >> (64 - kHintBits);
    hints_[hint / 64] |= std::uint64_t{1} << (hint % 64);
  }
  return slot.number;
}

void FrameCells::grow() {
  slots_.assign(std::max(kMinSlots, 2 * slots_.size()), Slot());
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    slots_[slotOf(groups_[g].cell, groups_[g].label)] = {groups_[g].cell, groups_[g].label,
                                                         static_cast<std::int32_t>(g)};
  }
}

}  // namespace planar_mapping::detail
