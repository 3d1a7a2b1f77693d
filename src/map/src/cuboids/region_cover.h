// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "cuboids/patch_cover.h"
#include "planar_mapping/core/cuboids/detail/compact_cover.h"
#include "store/map_data.h"
#include "store/surface_band.h"

namespace planar_mapping::detail {

/// A region's boxes, which stand for its non-planar cells and for what the rectangles of planes
/// leave, and its choice between small rectangles and boxes.
class RegionCover {
 public:
  /// A rectangle that boxes may take the place of.
  struct Choice {
    std::uint32_t cover = 0;  ///< the caller's number of the cover it is of
    std::size_t rectangle = 0;
    bool replaced = false;
  };

  RegionCover(const MapData& map, std::uint64_t key, CoverEffort effort);

  /// Adds a cover of which something is in the region or near it. Those of a plane come together.
  void add(std::uint32_t number, const PlaneLayer& plane, const PatchCover& cover);
  /// Makes the boxes of what was added.
  std::vector<Cuboid> boxes();

  /// As of boxes().
  const std::vector<Choice>& choices() const { return choices_; }
  /// May more effort need fewer cuboids?
  bool isProvisional() const { return is_provisional_; }
  bool isClutter() const { return is_clutter_; }

 private:
  void addRectangle(const Cuboid& cuboid, const HalfCellRectangle& place, const SurfaceBand& band,
                    bool may_go);

  const MapData& map_;
  const std::uint64_t key_;
  /// Quick: all rectangles stay.
  const CoverEffort effort_;
  bool is_provisional_ = false;
  bool is_clutter_ = false;
  Eigen::AlignedBox3d bounds_;  ///< of the region
  std::vector<const PlaneLayer*> near_;
  std::vector<SurfacePiece> pieces_;
  std::vector<Cuboid> present_;
  std::vector<ReplaceableCuboid> replaceable_;
  std::vector<Choice> choices_;  ///< of each of them
};

/// Regions in which the cover has or absorbs something, ascending.
std::vector<std::uint64_t> regionsOf(const MapData& map, const PlaneFrame& frame,
                                     const PatchCover& cover);

}  // namespace planar_mapping::detail
