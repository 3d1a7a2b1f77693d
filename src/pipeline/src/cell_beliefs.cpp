// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cell_beliefs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cell_key.h"
#include "planar_mapping/core/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr std::uint64_t kNoCell = ~std::uint64_t{0};
// Cells are counted from the sensor, so that floats are exact enough anywhere in the world.
constexpr std::int32_t kFarthest = 1 << 20;
constexpr std::size_t kFewestSlots = 1024;

constexpr std::size_t kBlock = 512;

/// Cell numbers of points along one axis, -kFarthest where too far or not a number.
PLANAR_MAPPING_MULTIVERSION
void cellsAlongAxis(const float* points, std::size_t stride, const int* indices, std::size_t n,
                    const float* row, float offset, std::int32_t* numbers) {
  constexpr auto kLimit = static_cast<float>(kFarthest - 1);
  const float a = row[0];
  const float b = row[1];
  const float c = row[2];
  const auto floats_apart = static_cast<int>(stride);
  for (std::size_t k = 0; k < n; ++k) {
    const float* p = points + static_cast<std::ptrdiff_t>(indices[k]) * floats_apart;
    const float cell = std::floor(a * p[0] + b * p[1] + c * p[2] + offset);
    numbers[k] = static_cast<std::int32_t>(std::fabs(cell) < kLimit ? cell : -kLimit - 1.0f);
  }
}

}  // namespace

void CellBeliefs::findCells(const PointsView& points, const Indices& indices,
                            const Pose& T_world_sensor) {
  float rows[3][3];
  float offset[3];
  std::int64_t origin[3];  // cell of the sensor
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < 3; ++i) {
      rows[axis][i] = static_cast<float>(T_world_sensor.linear()(axis, i) / params_.resolution);
    }
    const double shift = T_world_sensor.translation()[axis] / params_.resolution;
    const double whole = std::floor(shift);
    offset[axis] = static_cast<float>(shift - whole);
    constexpr double kBeyond = 1e15;
    origin[axis] = std::abs(whole) < kBeyond ? static_cast<std::int64_t>(whole) : 0;
  }
  cells_.resize(indices.size());
  std::int32_t numbers[3][kBlock];
  for (std::size_t first = 0; first < indices.size(); first += kBlock) {
    const std::size_t n = std::min(kBlock, indices.size() - first);
    for (int axis = 0; axis < 3; ++axis) {
      cellsAlongAxis(points.data, points.stride, indices.data() + first, n, rows[axis],
                     offset[axis], numbers[axis]);
    }
    for (std::size_t k = 0; k < n; ++k) {
      std::uint64_t key = 0;
      bool near = true;
      for (int axis = 0; axis < 3; ++axis) {
        near = near && numbers[axis][k] > -kFarthest;
        // Two million cells on, numbers repeat.
        key = (key << 21u) |
              (static_cast<std::uint64_t>(numbers[axis][k] + origin[axis]) & 0x1FFFFFu);
      }
      cells_[first + k] = near ? key : kNoCell;
    }
  }
}

void CellBeliefs::growGroups() {
  const std::vector<Slot> old = std::exchange(
      slots_, std::vector<Slot>(std::max(kFewestSlots, 2 * slots_.size()), Slot{kNoCell, -1, -1}));
  const std::size_t mask = slots_.size() - 1;
  for (const Slot& slot : old) {
    if (slot.number < 0) continue;
    std::size_t at = slotOfKey(slot.cell + static_cast<std::uint64_t>(slot.label), mask);
    while (slots_[at].number >= 0) at = (at + 1) & mask;
    slots_[at] = slot;
  }
}

std::int32_t CellBeliefs::groupOf(std::uint64_t cell, std::int32_t label) {
  const std::size_t mask = slots_.size() - 1;
  std::size_t at = slotOfKey(cell + static_cast<std::uint64_t>(label), mask);
  for (; slots_[at].number >= 0; at = (at + 1) & mask) {
    if (slots_[at].cell == cell && slots_[at].label == label) return slots_[at].number;
  }
  const auto number = static_cast<std::int32_t>(group_list_.size());
  slots_[at] = {cell, label, number};
  group_list_.push_back({cell, 0});
  if (2 * group_list_.size() > slots_.size()) growGroups();
  return number;
}

void CellBeliefs::sampleFeatures(const Indices& indices, const std::vector<std::int32_t>& labels) {
  group_list_.clear();
  features_.clear();
  feature_groups_.clear();
  std::fill(slots_.begin(), slots_.end(), Slot{kNoCell, -1, -1});
  if (slots_.empty()) growGroups();
  groups_.resize(indices.size());
  std::uint64_t last_cell = kNoCell;  // neighbouring points are mostly in the same cell
  std::int32_t last_label = -1;
  std::int32_t last_group = -1;
  for (std::size_t k = 0; k < indices.size(); ++k) {
    const std::uint64_t cell = cells_[k];
    if (cell == kNoCell) {
      groups_[k] = -1;
      continue;
    }
    const std::int32_t label = labels[static_cast<std::size_t>(indices[k])];
    if (cell != last_cell || label != last_label) {
      last_group = groupOf(cell, label);
      last_cell = cell;
      last_label = label;
    }
    groups_[k] = last_group;
    std::int32_t& count = group_list_[static_cast<std::size_t>(last_group)].features;
    if (count == params_.features_per_cell) continue;
    ++count;
    features_.push_back(indices[k]);
    feature_groups_.push_back(last_group);
  }
}

void CellBeliefs::rebuildBeliefs() {
  std::vector<Belief> old = std::exchange(beliefs_, {});
  if (params_.max_unseen_frames > 0) {
    const std::int64_t oldest = frame_ - params_.max_unseen_frames;
    old.erase(std::remove_if(old.begin(), old.end(),
                             [oldest](const Belief& belief) { return belief.frame < oldest; }),
              old.end());
  }
  old.erase(std::remove_if(old.begin(), old.end(),
                           [](const Belief& belief) { return belief.cell == kNoCell; }),
            old.end());
  known_ = old.size();
  std::size_t slots = kFewestSlots;
  while (slots < 4 * known_) slots *= 2;
  beliefs_.assign(slots, Belief{kNoCell, 0.0, 0});
  for (const Belief& belief : old) {
    std::size_t at = slotOfKey(belief.cell, slots - 1);
    while (beliefs_[at].cell != kNoCell) at = (at + 1) & (slots - 1);
    beliefs_[at] = belief;
  }
}

/// The belief in the cell; one last seen in frame 0 is new.
CellBeliefs::Belief& CellBeliefs::beliefOf(std::uint64_t cell) {
  if (2 * (known_ + 1) > beliefs_.size()) rebuildBeliefs();
  const std::size_t mask = beliefs_.size() - 1;
  std::size_t at = slotOfKey(cell, mask);
  while (beliefs_[at].cell != kNoCell && beliefs_[at].cell != cell) at = (at + 1) & mask;
  if (beliefs_[at].cell == kNoCell) {
    beliefs_[at] = {cell, 0.0, 0};
    ++known_;
  }
  return beliefs_[at];
}

CellBeliefs::Summary CellBeliefs::updateBeliefs(const PointsView& points, const Vector3& sensor) {
  ++frame_;
  const std::vector<float> seen =
      featureProbabilities(points, &features_, feature_groups_, params_.occupancy, sensor);
  // The cell is the identity: the observation is the mean over its features on all its planes.
  struct Mean {
    std::uint64_t cell;
    double sum;
    std::int32_t count;
    std::int32_t group;
  };
  std::vector<Mean> means(group_list_.size());
  for (std::size_t g = 0; g < means.size(); ++g) {
    means[g] = {group_list_[g].cell, 0.0, 0, static_cast<std::int32_t>(g)};
  }
  for (std::size_t k = 0; k < seen.size(); ++k) {
    Mean& mean = means[static_cast<std::size_t>(feature_groups_[k])];
    mean.sum += seen[k];
    ++mean.count;
  }
  std::sort(means.begin(), means.end(), [](const Mean& a, const Mean& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.group < b.group;
  });
  Summary summary;
  group_belief_.resize(means.size());
  for (std::size_t first = 0; first < means.size();) {
    std::size_t end = first;
    double sum = 0.0;
    double count = 0.0;
    for (; end < means.size() && means[end].cell == means[first].cell; ++end) {
      sum += means[end].sum;
      count += means[end].count;
    }
    const double observed = std::clamp(sum / count, 0.0, 1.0);
    Belief& belief = beliefOf(means[first].cell);
    const bool forgotten =
        params_.max_unseen_frames > 0 && frame_ - belief.frame > params_.max_unseen_frames + 1;
    if (belief.frame == 0 || forgotten) {
      belief.value = observed;
      ++summary.created;
    } else {
      belief.value = updatedBelief(belief.value, observedBelief(observed, 1.0, params_.update),
                                   params_.update);
      ++summary.updated;
    }
    belief.frame = frame_;
    for (; first < end; ++first) {
      group_belief_[static_cast<std::size_t>(means[first].group)] =
          static_cast<float>(std::clamp(belief.value, 0.0, 1.0));
    }
  }
  return summary;
}

CellBeliefs::Summary CellBeliefs::update(const PointsView& points, const Indices& indices,
                                         const std::vector<std::int32_t>& labels,
                                         const Pose& T_world_sensor,
                                         std::vector<float>& probability) {
  findCells(points, indices, T_world_sensor);
  sampleFeatures(indices, labels);
  const Summary summary = updateBeliefs(points, Vector3::Zero());
  const auto lonely = static_cast<float>(params_.occupancy.single_feature_probability);
  for (std::size_t k = 0; k < indices.size(); ++k) {
    probability[static_cast<std::size_t>(indices[k])] =
        groups_[k] < 0 ? lonely : group_belief_[static_cast<std::size_t>(groups_[k])];
  }
  return summary;
}

}  // namespace planar_mapping::detail
