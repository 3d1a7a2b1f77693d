// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "cuboids/joined_boxes.h"
#include "store/key_map.h"
#include "cuboids/listed_boxes.h"
#include "store/map_data.h"
#include "cuboids/packed_cover.h"
#include "cuboids/region_cover.h"

namespace planar_mapping::detail {

/// The cuboids of a map: derived from its cells when they are asked for, and made again only where
/// cells changed since. What comes out depends on the cells alone, not on what was asked before.
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
  /// Makes the list of the cuboids as of the last update, from when nothing may have changed and
  /// after which all regions are settled: those of the patches by plane and patch, then those of
  /// the regions, then joined ones.
  const std::vector<Cuboid>& makeList(const MapData& map);
  const std::vector<Cuboid>& list() const { return list_; }
  std::size_t memoryBytes() const;

 private:
  using Planes = std::vector<PlaneLayer>;
  using Records = std::vector<PackedRecords::Record>;
  /// A patch of the map and its cover.
  struct Slot {
    static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

    std::size_t position = 0;    ///< of the plane among those of the map
    std::size_t patch = 0;       ///< of the plane's raster
    std::size_t before = kNone;  ///< record of its cover as of the last update, if there is one
    bool covered = true;         ///< no cells changed since
    bool placed = true;          ///< nor did the plane move
    PatchCover cover;            ///< the new one, if something did
  };
  struct Region {
    std::uint32_t revision = 0;
    bool dirty = true;
    bool provisional = false;  ///< covered quickly: that is to be done again
    ListedBoxes boxes;         ///< that are not joined
  };
  /// A region that is to be covered.
  struct RegionTask {
    std::size_t region = 0;  ///< position in regions_
    CoverEffort effort = CoverEffort::Full;
    std::vector<std::uint32_t> near;  ///< positions of covers that have or absorb something in it
  };
  std::vector<Slot> matchCovers(const MapData& map, const Planes& planes, const Records& before);
  void makeCovers(const MapData& map, const Planes& planes, const Records& before,
                  std::vector<Slot>& slots);
  void markRegions(const std::vector<std::uint64_t>& keys) {
    for (const std::uint64_t key : keys) regions_[key].dirty = true;
  }
  /// \param slots  of each of the covers
  void coverRegions(const MapData& map, const Planes& planes, const std::vector<Slot>& slots,
                    CoverEffort effort);
  void coverRegion(const MapData& map, const Planes& planes, const std::vector<Slot>& slots,
                   const Records& covers, const RegionTask& task);
  void joinRegions(const MapData& map, const Planes& planes, const std::vector<Slot>& slots);
  /// Gives regions back what was joined, as these regions changed.
  void separate(const std::vector<std::uint64_t>& changed, double cell);
  std::vector<std::uint64_t> sortedRegions() const;

  Int3 anchor_;
  bool settled_ = true;
  std::size_t count_ = 0;
  PackedRecords covers_;    ///< of the patches, by plane and key, ascending
  KeyMap<Region> regions_;  ///< by CellLayer::regionKey()
  JoinedBoxes joined_;
  std::vector<Cuboid> list_;
};

}  // namespace planar_mapping::detail
