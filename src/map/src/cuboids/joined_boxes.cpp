// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/joined_boxes.h"

#include <algorithm>
#include <array>

#include "store/packed_numbers.h"
#include "planar_mapping/core/base/detail/parallel.h"

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

/// All that a box says.
std::array<double, 12> numbersOf(const Cuboid& box) {
  const auto& q = box.orientation.coeffs();
  return {box.center.x(),
          box.center.y(),
          box.center.z(),
          box.size.x(),
          box.size.y(),
          box.size.z(),
          q[0],
          q[1],
          q[2],
          q[3],
          static_cast<double>(box.plane_id),
          static_cast<double>(box.probability)};
}

}  // namespace

void JoinedBoxes::pack(const std::vector<Group>& groups, double cell) {
  packed_.reset(groups.empty() ? nullptr : new Packed);
  if (groups.empty()) return;
  PackWriter out;
  out.number(groups.size());
  Int3 last;
  std::vector<Cuboid> boxes;
  for (const Group& group : groups) {
    out.number(group.regions.size());
    for (const std::uint64_t region : group.regions) putRegion(region, last, out);
    out.number(group.members.size());
    for (std::size_t i = 0; i < group.members.size(); ++i) {
      const RegionBox& member = group.members[i];
      const auto at = std::lower_bound(group.regions.begin(), group.regions.end(), member.region);
      out.number(static_cast<std::uint64_t>(at - group.regions.begin()));
      out.number(std::uint64_t{member.number} << 1u | (group.replaced[i] != 0 ? 1u : 0u));
    }
    out.number(group.boxes.size());
    boxes.insert(boxes.end(), group.boxes.begin(), group.boxes.end());
  }
  packed_->groups = PackedBytes(out.bytes);
  packed_->boxes = ListedBoxes(boxes, cell);
}

std::vector<JoinedBoxes::Group> JoinedBoxes::unpacked(const std::vector<Cuboid>& list,
                                                      double cell) const {
  if (!packed_) return {};
  const std::vector<Cuboid> boxes = packed_->boxes.unpacked(list, cell);
  auto box = boxes.begin();
  PackReader in(packed_->groups.data());
  std::vector<Group> groups(in.as<std::size_t>());
  Int3 last;
  for (Group& group : groups) {
    group.regions.resize(in.as<std::size_t>());
    for (std::uint64_t& region : group.regions) region = takeRegion(last, in);
    group.members.resize(in.as<std::size_t>());
    for (RegionBox& member : group.members) {
      member.region = group.regions[in.as<std::size_t>()];
      const std::uint64_t number = in.number();
      member.number = static_cast<std::uint32_t>(number >> 1u);
      group.replaced.push_back(static_cast<char>(number & 1u));
    }
    const auto count = in.as<std::ptrdiff_t>();
    group.boxes.assign(box, box + count);
    box += count;
  }
  return groups;
}

std::vector<JoinedBoxes::PlacedBox> JoinedBoxes::release(std::vector<std::uint64_t> regions,
                                                         const std::vector<Cuboid>& list,
                                                         double cell) {
  std::vector<PlacedBox> released;
  if (regions.empty()) return released;
  complete_ = false;
  if (!packed_) return released;
  std::vector<Group> groups = unpacked(list, cell);
  std::vector<Cuboid> members;
  packed_->members.appendTo(members, cell);
  if (!members.empty()) {
    auto box = members.begin();
    for (const Group& group : groups) {
      for (std::size_t i = 0; i < group.members.size(); ++i) {
        if (group.replaced[i] != 0) released.emplace_back(group.members[i], *box++);
      }
    }
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
                                         const std::vector<Cuboid>& list, const CoverGroup& cover) {
  std::vector<Group> before = unpacked(list, map.resolution());
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
    GroupCover again(map, tasks[i].second);
    const bool is_better = cover(again);
    group.regions = again.regions();
    replace(tasks[i].second, is_better ? again.boxes() : tasks[i].second, group);
  });
  std::vector<RegionBox> joined;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (std::size_t i = 0; i < found[g].size(); ++i) {
      if (groups[g].replaced[i] == 0) continue;
      joined.push_back(boxes[found[g][i]].first);
      members.push_back(boxes[found[g][i]].second);
    }
  }
  std::sort(joined.begin(), joined.end());
  pack(groups, map.resolution());
  if (packed_) packed_->members = PackedBoxes(members, map.resolution());
  complete_ = true;
  return joined;
}

}  // namespace planar_mapping::detail
