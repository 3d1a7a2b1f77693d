// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/map/cuboids/joined_boxes.h"
#include "planar_mapping/map/store/key_map.h"
#include "planar_mapping/map/store/map_data.h"

namespace planar_mapping::detail {

/// The cuboids of a map: derived from its cells when they are asked for, and again only where cells
/// changed since. What comes out depends on the cells alone, not on what was asked before.
///
/// First each patch of a plane gets its rectangles. What is left of the planes and the non-planar
/// cells is covered region by region, as far as the rectangles near it do not stand for it; small
/// rectangles that lie within one region give way to boxes where that needs fewer cuboids. Last,
/// boxes of several regions are joined across the borders (JoinedBoxes).
class Compaction {
 public:
  /// \param effort for regions that changed since the last update; those that no longer do are
  ///               always covered fully. Only with full effort boxes are joined across borders.
  void update(const MapData& map, CoverEffort effort);
  /// As of the last update.
  std::size_t count() const { return count_; }
  /// Are all regions covered fully and joined? Otherwise there may be fewer cuboids than count().
  bool isSettled() const { return settled_; }
  /// Makes the list of the cuboids as of the last update, since when nothing may have changed and
  /// after which all regions are settled: those of the patches by plane and patch, then those of
  /// the regions, then joined ones.
  const std::vector<Cuboid>& makeList(const MapData& map);
  const std::vector<Cuboid>& list() const { return list_; }
  std::size_t memoryBytes() const;
  /// Regions with too many boxes to search for fewer, as of the last update.
  std::size_t clutteredRegions() const;

 private:
  struct Region {
    std::uint32_t revision = 0;
    bool dirty = true;
    bool provisional = false;  ///< covered quickly: that is to be done again
    bool is_clutter = false;   ///< its boxes are too many to be joined with others
    std::vector<Cuboid> boxes;
    std::vector<char> joined;  ///< of each box: is it replaced by joined ones?

    void setBoxes(std::vector<Cuboid> all) {
      boxes = std::move(all);
      boxes.shrink_to_fit();
      joined.assign(boxes.size(), 0);
    }
  };
  /// A region that is to be covered.
  struct RegionTask {
    std::size_t region = 0;  ///< position in regions_
    CoverEffort effort = CoverEffort::Full;
    std::vector<std::uint32_t> near;  ///< positions of covers that have or absorb something in it
  };
  void updateCovers(const MapData& map);
  void coverRegions(const MapData& map, CoverEffort effort);
  void coverRegion(const MapData& map, const RegionTask& task);
  void joinRegions(const MapData& map);
  void markRegions(const std::vector<std::uint64_t>& keys) {
    for (const std::uint64_t key : keys) regions_[key].dirty = true;
  }

  Int3 anchor_;
  bool settled_ = true;
  std::size_t count_ = 0;
  std::vector<PatchCover> covers_;  ///< by plane and key, ascending
  KeyMap<Region> regions_;          ///< by CellLayer::regionKey()
  JoinedBoxes joined_;
  std::vector<Cuboid> list_;
};

}  // namespace planar_mapping::detail
