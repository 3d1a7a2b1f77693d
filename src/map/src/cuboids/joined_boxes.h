// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "cuboids/box_groups.h"
#include "cuboids/group_cover.h"
#include "store/heap_bytes.h"
#include "cuboids/listed_boxes.h"
#include "store/packed_bytes.h"

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
  /// again, all are their regions'. \param list  that took boxes over
  /// \return those that were not, by region and number
  std::vector<PlacedBox> release(std::vector<std::uint64_t> regions,
                                 const std::vector<Cuboid>& list, double cell);
  /// Is nothing left to be joined?
  bool isComplete() const { return complete_; }
  /// \param boxes of all regions, each covered by itself; ascending by region and number
  /// \param list  that took boxes over
  /// \return those that are no longer their regions', ascending
  std::vector<RegionBox> join(const MapData& map, const std::vector<PlacedBox>& boxes,
                              const std::vector<Cuboid>& list, const CoverGroup& cover);

  /// Number of boxes; none until they are joined again.
  std::size_t size() const { return complete_ && packed_ ? packed_->boxes.size() : 0; }
  /// The end of the next list takes them over.
  void moveTo(std::vector<Cuboid>& next, const std::vector<Cuboid>& list, double cell) {
    if (packed_) packed_->boxes.moveTo(next, list, cell);
  }
  std::size_t memoryBytes() const {
    if (!packed_) return 0;
    return heapBytes(sizeof(Packed)) + packed_->groups.memoryBytes() +
           packed_->members.memoryBytes() + packed_->boxes.memoryBytes();
  }

 private:
  struct Group {
    std::vector<RegionBox> members;      ///< ascending
    std::vector<std::uint64_t> regions;  ///< that have to do with it, ascending
    std::vector<char> replaced;          ///< of each member: is it one that boxes replace?
    std::vector<Cuboid> boxes;           ///< in the place of these; fewer, or none at all
  };
  static void replace(const std::vector<Cuboid>& members, std::vector<Cuboid> boxes, Group& group);
  std::vector<Group> unpacked(const std::vector<Cuboid>& list, double cell) const;
  void pack(const std::vector<Group>& groups, double cell);

  /// Most maps are small and have no groups.
  struct Packed {
    PackedBytes groups;   ///< by their first member
    PackedBoxes members;  ///< that are replaced, until they are released
    ListedBoxes boxes;
  };
  std::unique_ptr<Packed> packed_;
  bool complete_ = true;
};

}  // namespace planar_mapping::detail
