// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include "planar_mapping/map/cuboids/patch_cover.h"
#include "planar_mapping/map/store/map_data.h"

namespace planar_mapping::detail {

/// A box of a region, as it is covered by itself.
struct RegionBox {
  std::uint64_t region = 0;  ///< CellLayer::regionKey()
  std::uint32_t number = 0;  ///< among those of the region

  bool operator==(const RegionBox& o) const { return region == o.region && number == o.number; }
  bool operator<(const RegionBox& o) const {
    return std::tie(region, number) < std::tie(o.region, o.number);
  }
};

/// Boxes in the place of those of several regions: each region is covered by itself, which cuts
/// what lies across borders. What is joined depends on the regions' boxes and on what these stand
/// for alone; a group of boxes is covered again only where something near it changed.
class JoinedBoxes {
 public:
  using PlacedBox = std::pair<RegionBox, Cuboid>;

  /// Forgets what has to do with regions that are no longer what they were. Until boxes are joined
  /// again, all are their regions'. \param regions  ascending
  void release(const std::vector<std::uint64_t>& regions);
  /// Is nothing left to be joined?
  bool isComplete() const { return complete_; }
  /// \param boxes  of all regions, each covered by itself; ascending by region and number
  /// \param covers  of all patches, those of a plane together
  /// \return those that are no longer their regions'
  std::vector<RegionBox> join(const MapData& map, const std::vector<PlacedBox>& boxes,
                              const std::vector<PatchCover>& covers);
  /// Number of boxes; none until they are joined again.
  std::size_t size() const;
  void appendTo(std::vector<Cuboid>& boxes) const;
  std::size_t memoryBytes() const;

 private:
  struct Group {
    std::vector<RegionBox> members;      ///< ascending
    std::vector<std::uint64_t> regions;  ///< that have to do with it, ascending
    std::vector<char> replaced;          ///< of each member: is it one that boxes replace?
    std::vector<Cuboid> boxes;           ///< in the place of these; fewer, or none at all
  };
  static void replace(const std::vector<Cuboid>& members, std::vector<Cuboid> boxes, Group& group);

  std::vector<Group> groups_;  ///< by their first member
  bool complete_ = true;
};

}  // namespace planar_mapping::detail
