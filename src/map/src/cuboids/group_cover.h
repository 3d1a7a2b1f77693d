// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "cuboids/patch_cover.h"
#include "planar_mapping/core/cuboids/detail/compact_cover.h"
#include "store/map_data.h"

namespace planar_mapping::detail {

/// Covers anew, across borders, what a group of boxes of several regions stands for.
class GroupCover {
 public:
  GroupCover(const MapData& map, std::vector<Cuboid> boxes);

  /// Those that have to do with the group, whether or not they hold one of its boxes; ascending. As
  /// long as nothing changes in them the cover stays the same.
  const std::vector<std::uint64_t>& regions() const { return regions_; }
  /// Adds a cover that has or absorbs something in one of them. Those of a plane come together.
  void add(const PlaneLayer& plane, const PatchCover& cover);
  /// Makes the cover of what was added and of the cells. \return whether it needs fewer boxes
  bool run();
  const std::vector<Cuboid>& boxes() const { return boxes_; }

 private:
  bool isNear(const Int3& block) const;
  std::vector<NonPlanarCell> cells() const;

  const MapData& map_;
  std::vector<Cuboid> boxes_;
  std::vector<std::uint64_t> blocks_;  ///< that the boxes come near, ascending
  std::vector<std::uint64_t> regions_;
  Eigen::AlignedBox3d bounds_;  ///< of the boxes
  std::vector<const PlaneLayer*> near_;
  std::vector<SurfacePiece> pieces_;
  std::vector<Cuboid> present_;
};

}  // namespace planar_mapping::detail
