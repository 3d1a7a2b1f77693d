// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/joined_boxes.h"

#include <algorithm>
#include <array>
#include <utility>

#include "planar_mapping/core/base/detail/parallel.h"

namespace planar_mapping::detail {
namespace {

/// All that a box says.
std::array<double, 12> numbersOf(const Cuboid& box) {
  std::array<double, 12> numbers;
  Eigen::Map<Eigen::Matrix<double, 12, 1>>(numbers.data()) << box.center, box.size,
      box.orientation.coeffs(), box.plane_id, box.probability;
  return numbers;
}

}  // namespace

void JoinedBoxes::release(const std::vector<std::uint64_t>& regions) {
  if (regions.empty()) return;
  complete_ = false;
  const auto isChanged = [&](std::uint64_t region) {
    return std::binary_search(regions.begin(), regions.end(), region);
  };
  const auto isOver = [&](const Group& group) {
    return std::any_of(group.regions.begin(), group.regions.end(), isChanged);
  };
  groups_.erase(std::remove_if(groups_.begin(), groups_.end(), isOver), groups_.end());
}

std::size_t JoinedBoxes::size() const {
  std::size_t size = 0;
  if (complete_) {
    for (const Group& group : groups_) size += group.boxes.size();
  }
  return size;
}

void JoinedBoxes::appendTo(std::vector<Cuboid>& boxes) const {
  for (const Group& group : groups_) {
    boxes.insert(boxes.end(), group.boxes.begin(), group.boxes.end());
  }
}

std::size_t JoinedBoxes::memoryBytes() const {
  std::size_t bytes = capacityBytes(groups_);
  for (const Group& g : groups_) {
    bytes += capacityBytes(g.members) + capacityBytes(g.regions) + capacityBytes(g.replaced) +
             capacityBytes(g.boxes);
  }
  return bytes;
}

/// Members that are among the boxes as they are stay their regions'.
void JoinedBoxes::replace(const std::vector<Cuboid>& members, std::vector<Cuboid> boxes,
                          Group& group) {
  const auto isBefore = [](const Cuboid& l, const Cuboid& r) {
    return numbersOf(l) < numbersOf(r);
  };
  std::sort(boxes.begin(), boxes.end(), isBefore);
  group.replaced.assign(members.size(), 1);
  for (std::size_t i = 0; i < members.size(); ++i) {
    const auto same = std::lower_bound(boxes.begin(), boxes.end(), members[i], isBefore);
    if (same == boxes.end() || isBefore(members[i], *same)) continue;
    group.replaced[i] = 0;
    boxes.erase(same);
  }
  group.boxes = std::move(boxes);
}

std::vector<RegionBox> JoinedBoxes::join(const MapData& map, const std::vector<PlacedBox>& boxes,
                                         const CoverGroup& cover) {
  std::vector<Group> before = std::exchange(groups_, {});
  auto old = before.begin();
  std::vector<std::pair<std::size_t, std::vector<Cuboid>>> tasks;  // a group, and its members
  const std::vector<std::vector<std::uint32_t>> found = groupAcrossBorders(boxes, map.resolution());
  for (const std::vector<std::uint32_t>& positions : found) {
    Group group;
    for (const std::uint32_t i : positions) group.members.push_back(boxes[i].first);
    while (old != before.end() && old->members.front() < group.members.front()) ++old;
    if (old != before.end() && old->members == group.members) {
      group = std::move(*old++);
    } else {
      tasks.emplace_back(groups_.size(), std::vector<Cuboid>());
      for (const std::uint32_t i : positions) tasks.back().second.push_back(boxes[i].second);
    }
    groups_.push_back(std::move(group));
  }
  parallelFor(tasks.size(), map.params.approximation.threads, [&](std::size_t i) {
    Group& group = groups_[tasks[i].first];
    GroupCover again(map, tasks[i].second);
    const bool is_better = cover(again);
    group.regions = again.regions();
    replace(tasks[i].second, is_better ? again.boxes() : tasks[i].second, group);
  });
  std::vector<RegionBox> joined;
  for (const Group& group : groups_) {
    for (std::size_t i = 0; i < group.members.size(); ++i) {
      if (group.replaced[i] != 0) joined.push_back(group.members[i]);
    }
  }
  complete_ = true;
  return joined;
}

}  // namespace planar_mapping::detail
