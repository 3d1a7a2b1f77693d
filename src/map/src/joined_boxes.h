// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "box_groups.h"
#include "group_cover.h"
#include "packed_boxes.h"
#include "packed_bytes.h"

namespace planar_mapping::detail {

/// Boxes in the place of those of several regions: each region is covered by itself, which cuts
/// what lies across borders. What is joined depends on the regions' boxes and on what these stand
/// for alone; a group of boxes is covered again only where something near it changed.
class JoinedBoxes {
 public:
  /// Adds what is near the group, and runs it.
  using CoverGroup = std::function<bool(GroupCover&)>;
  using PlacedBox = std::pair<RegionBox, Cuboid>;

  /// Forgets what has to do with regions that are no longer what they were. Until boxes are joined
  /// again, all are their regions'.
  /// \return those that were not, by region and number
  std::vector<PlacedBox> release(std::vector<std::uint64_t> regions, double cell);
  /// Is nothing left to be joined?
  bool isComplete() const { return complete_; }
  /// \param boxes of all regions, each covered by itself; ascending by region and number
  /// \return those that are no longer their regions', ascending
  std::vector<RegionBox> join(const MapData& map, const std::vector<PlacedBox>& boxes,
                              const CoverGroup& cover);

  std::size_t size() const { return boxes_.size(); }
  void appendTo(std::vector<Cuboid>& list, double cell) const { boxes_.appendTo(list, cell); }
  std::size_t memoryBytes() const {
    return groups_.memoryBytes() + members_.memoryBytes() + boxes_.memoryBytes();
  }

 private:
  struct Group {
    std::vector<RegionBox> members;      ///< ascending
    std::vector<std::uint64_t> regions;  ///< that have to do with it, ascending
    std::vector<Cuboid> boxes;           ///< in their place, if that needs fewer
    bool is_better = false;
  };
  std::vector<Group> unpacked(double cell) const;
  void pack(const std::vector<Group>& groups, double cell);

  PackedBytes groups_;   ///< by their first member
  PackedBoxes members_;  ///< of the better ones, while these take their place
  PackedBoxes boxes_;
  bool complete_ = true;
};

}  // namespace planar_mapping::detail
