// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "key_map.h"
#include "map_data.h"
#include "planar_mapping/core/compact_cover.h"
#include "surface_band.h"
#include "tight_list.h"

namespace planar_mapping::detail {

/// The cuboids of a map: derived from its cells when they are asked for, and made again only where
/// cells changed since. What comes out depends on the cells alone, not on what was asked before.
///
/// First each patch of a plane gets its rectangles. What is left of the planes and the non-planar
/// cells is covered region by region, as far as the rectangles near it do not stand for it; small
/// rectangles that lie within one region give way to boxes where that needs fewer cuboids.
class Compaction {
 public:
  void update(const MapData& map);
  /// As of the last update.
  std::size_t count() const { return count_; }
  /// Makes the list of the cuboids as of the last update, from when nothing may have changed:
  /// those of the patches by plane and patch, then those of the regions.
  const std::vector<Cuboid>& makeList(const MapData& map);
  const std::vector<Cuboid>& list() const { return list_; }
  std::size_t memoryBytes() const;

 private:
  struct PatchRectangle {
    HalfCellRectangle rectangle;
    float probability = 1.0f;
    bool replaced = false;  ///< a region has boxes in its place
  };
  struct Patch {
    std::uint32_t revision = 0;
    TightList<PatchRectangle> rectangles;  ///< its cover, like the next
    TightList<LooseQuarter> loose;
    TightList<std::uint64_t> regions;  ///< in which it has or absorbs something; ascending

    void setCover(const SurfaceCover& cover);
  };
  struct Plane {
    std::int32_t id = 0;
    std::uint32_t frame_revision = 0;  ///< as of the last update, like the next
    SurfaceBand band;
    KeyMap<Patch> patches;
  };
  /// A patch whose cells changed, and its new cover.
  struct ChangedPatch {
    std::size_t plane = 0;
    std::uint64_t key = 0;
    std::vector<PlacedTile> tiles;
    SurfaceCover cover;
  };
  struct Region {
    std::uint32_t revision = 0;
    bool dirty = true;
    std::vector<Cuboid> cuboids;  ///< until the list takes them over
    std::uint32_t first = 0;      ///< of those that the list has
    std::uint32_t listed = 0;     ///< how many
    /// Patches that have or absorb something here, by plane and key; repeated or outdated ones are
    /// sorted out when the region is covered.
    std::vector<std::pair<std::int32_t, std::uint64_t>> patches;
  };

  /// \return whether all its cuboids moved
  bool updatePlane(const MapData& map, std::size_t position, std::vector<ChangedPatch>& changes);
  void placePatches(const MapData& map, const std::vector<char>& moved,
                    std::vector<ChangedPatch>& changes);
  void findRegions(const MapData& map, const PlaneFrame& frame, const SurfaceBand& band,
                   Patch& patch) const;
  void markRegions(const Patch& patch) {
    for (const std::uint64_t key : patch.regions) regions_[key].dirty = true;
  }
  void coverRegion(const MapData& map, std::uint64_t key, Region& region);
  Plane* find(std::int32_t id);

  Int3 anchor_;
  std::vector<Plane> planes_;  ///< those of the map, in its order: by id, ascending
  KeyMap<Region> regions_;     ///< by CellLayer::regionKey()
  std::size_t count_ = 0;
  std::vector<Cuboid> list_;
};

}  // namespace planar_mapping::detail
