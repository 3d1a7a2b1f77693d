// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "joined_boxes.h"

#include <algorithm>

#include "packed_numbers.h"
#include "planar_mapping/core/parallel.h"

namespace planar_mapping::detail {
namespace {

/// Regions lie near each other.
void putRegion(std::uint64_t region, Int3& last, PackWriter& out) {
  const Int3 at = unpackKey(region);
  out.difference(at.x - last.x);
  out.difference(at.y - last.y);
  out.difference(at.z - last.z);
  last = at;
}
std::uint64_t takeRegion(Int3& last, PackReader& in) {
  last.x += in.differenceAs<std::int32_t>();
  last.y += in.differenceAs<std::int32_t>();
  last.z += in.differenceAs<std::int32_t>();
  return packKey(last);
}

}  // namespace

void JoinedBoxes::pack(const std::vector<Group>& groups, double cell) {
  PackWriter out;
  out.number(groups.size());
  Int3 last;
  std::vector<Cuboid> boxes;
  for (const Group& group : groups) {
    out.number(group.regions.size());
    for (const std::uint64_t region : group.regions) putRegion(region, last, out);
    out.number(group.members.size());
    for (const RegionBox& member : group.members) {
      const auto at = std::lower_bound(group.regions.begin(), group.regions.end(), member.region);
      out.number(static_cast<std::uint64_t>(at - group.regions.begin()));
      out.number(member.number);
    }
    out.number(group.is_better ? group.boxes.size() + 1 : 0);
    boxes.insert(boxes.end(), group.boxes.begin(), group.boxes.end());
  }
  groups_ = groups.empty() ? PackedBytes() : PackedBytes(out.bytes);
  boxes_ = PackedBoxes(boxes, cell);
}

std::vector<JoinedBoxes::Group> JoinedBoxes::unpacked(double cell) const {
  if (groups_.empty()) return {};
  std::vector<Cuboid> boxes;
  boxes_.appendTo(boxes, cell);
  auto box = boxes.begin();
  PackReader in(groups_.data());
  std::vector<Group> groups(in.as<std::size_t>());
  Int3 last;
  for (Group& group : groups) {
    group.regions.resize(in.as<std::size_t>());
    for (std::uint64_t& region : group.regions) region = takeRegion(last, in);
    group.members.resize(in.as<std::size_t>());
    for (RegionBox& member : group.members) {
      member.region = group.regions[in.as<std::size_t>()];
      member.number = in.as<std::uint32_t>();
    }
    const auto count = in.as<std::ptrdiff_t>();
    group.is_better = count > 0;
    if (!group.is_better) continue;
    group.boxes.assign(box, box + (count - 1));
    box += count - 1;
  }
  return groups;
}

std::vector<JoinedBoxes::PlacedBox> JoinedBoxes::release(std::vector<std::uint64_t> regions,
                                                         double cell) {
  std::vector<PlacedBox> released;
  if (regions.empty()) return released;
  complete_ = false;
  std::vector<Group> groups = unpacked(cell);
  std::vector<Cuboid> members;
  members_.appendTo(members, cell);
  if (!members.empty()) {
    auto box = members.begin();
    for (const Group& group : groups) {
      if (!group.is_better) continue;
      for (const RegionBox& member : group.members) released.emplace_back(member, *box++);
    }
    members_ = PackedBoxes();
  }
  std::sort(released.begin(), released.end(),
            [](const PlacedBox& l, const PlacedBox& r) { return l.first < r.first; });
  std::sort(regions.begin(), regions.end());
  const auto isChanged = [&](std::uint64_t region) {
    return std::binary_search(regions.begin(), regions.end(), region);
  };
  const auto isOver = [&](const Group& group) {
    return std::any_of(group.regions.begin(), group.regions.end(), isChanged);
  };
  groups.erase(std::remove_if(groups.begin(), groups.end(), isOver), groups.end());
  pack(groups, cell);
  return released;
}

std::vector<RegionBox> JoinedBoxes::join(const MapData& map, const std::vector<PlacedBox>& boxes,
                                         const CoverGroup& cover) {
  std::vector<Group> before = unpacked(map.resolution());
  auto old = before.begin();
  std::vector<Group> groups;
  std::vector<std::pair<std::size_t, std::vector<Cuboid>>> tasks;  // a group, and its members
  std::vector<Cuboid> members;
  std::vector<std::vector<std::uint32_t>> found = groupAcrossBorders(boxes, map.resolution());
  for (const std::vector<std::uint32_t>& positions : found) {
    Group group;
    for (const std::uint32_t i : positions) group.members.push_back(boxes[i].first);
    while (old != before.end() && old->members.front() < group.members.front()) ++old;
    if (old != before.end() && old->members == group.members) {
      group = std::move(*old++);
    } else {
      tasks.emplace_back(groups.size(), std::vector<Cuboid>());
      for (const std::uint32_t i : positions) tasks.back().second.push_back(boxes[i].second);
    }
    groups.push_back(std::move(group));
  }
  parallelFor(tasks.size(), map.params.approximation.threads, [&](std::size_t i) {
    Group& group = groups[tasks[i].first];
    GroupCover again(map, std::move(tasks[i].second));
    group.is_better = cover(again);
    group.regions = again.regions();
    if (group.is_better) group.boxes = again.boxes();
  });
  std::vector<RegionBox> joined;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (!groups[g].is_better) continue;
    for (const std::uint32_t i : found[g]) {
      joined.push_back(boxes[i].first);
      members.push_back(boxes[i].second);
    }
  }
  std::sort(joined.begin(), joined.end());
  members_ = PackedBoxes(members, map.resolution());
  pack(groups, map.resolution());
  complete_ = true;
  return joined;
}

}  // namespace planar_mapping::detail
