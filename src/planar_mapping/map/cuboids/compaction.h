// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "planar_mapping/map/cuboids/patch_cover.h"
#include "planar_mapping/map/store/key_map.h"
#include "planar_mapping/map/store/map_data.h"

namespace planar_mapping::detail {

/// The cuboids of a map: derived from its cells when they are asked for, and again only where cells
/// changed since. What comes out depends on the cells alone, not on what was asked before.
///
/// First each patch of a plane gets its rectangles. What is left of the planes and the non-planar
/// cells is covered region by region, as far as the rectangles near it do not stand for it; small
/// rectangles that lie within one region give way to boxes where that needs fewer cuboids.
class Compaction {
 public:
  void update(const MapData& map);
  /// As of the last update.
  std::size_t count() const { return count_; }
  /// Makes the list of the cuboids as of the last update, since when nothing may have changed:
  /// those of the patches by plane and patch, then those of the regions.
  const std::vector<Cuboid>& makeList(const MapData& map);
  const std::vector<Cuboid>& list() const { return list_; }
  std::size_t memoryBytes() const;
  /// Regions with so many boxes that they were swept, as of the last update.
  std::size_t clutteredRegions() const;

 private:
  struct Region {
    std::uint32_t revision = 0;
    bool dirty = true;
    bool is_clutter = false;  ///< its boxes are swept
    std::vector<Cuboid> boxes;
  };
  /// A region that is to be covered.
  struct RegionTask {
    std::size_t region = 0;           ///< position in regions_
    std::vector<std::uint32_t> near;  ///< positions of covers that have or absorb something in it
  };
  void updateCovers(const MapData& map);
  void coverRegions(const MapData& map);
  void coverRegion(const MapData& map, const RegionTask& task);
  void markRegions(const std::vector<std::uint64_t>& keys) {
    for (const std::uint64_t key : keys) regions_[key].dirty = true;
  }

  Int3 anchor_;
  std::size_t count_ = 0;
  std::vector<PatchCover> covers_;  ///< by plane and key, ascending
  KeyMap<Region> regions_;          ///< by CellLayer::regionKey()
  std::vector<Cuboid> list_;
};

}  // namespace planar_mapping::detail
