// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/region_cover.h"

#include <algorithm>
#include <utility>

#include "cuboids/cover_geometry.h"

namespace planar_mapping::detail {
RegionCover::RegionCover(const MapData& map, std::uint64_t key, CoverEffort effort)
    : map_(map), key_(key), effort_(effort) {
  const double s = map.resolution();
  const Int3& anchor = map.cells.anchor;
  const Int3 at = unpackKey(key);
  const Vector3 low =
      s * (Vector3(anchor.x, anchor.y, anchor.z) + kRegionCells * Vector3(at.x, at.y, at.z));
  bounds_ = {low, low + Vector3::Constant(kRegionCells * s)};
}

void RegionCover::add(std::uint32_t number, const PlaneLayer& plane, const PatchCover& cover) {
  const CuboidApproximationParams& params = map_.params.approximation;
  if (near_.empty() || near_.back() != &plane) near_.push_back(&plane);
  const PlaneFrame& frame = plane.frame();
  const SurfaceBand band = surfaceBand(map_, cover.spread);
  std::vector<Cuboid> cuboids;
  for (const PatchCover::Rectangle& r : cover.rectangles) {
    cuboids.push_back(cuboidOf(r.place, frame, band, params));
  }
  const std::vector<std::uint8_t> may_go = replaceableOf(cuboids, params);
  for (std::size_t r = 0; r < cuboids.size(); ++r) {
    const std::size_t before = replaceable_.size();
    addRectangle(cuboids[r], cover.rectangles[r].place, band, may_go[r] != 0);
    if (replaceable_.size() > before) choices_.push_back({number, r, false});
  }
  for (const LooseQuarter& quarter : cover.loose) {
    const Vector3 center = centerOf(quarter, frame, map_.resolution());
    if (regionOf(map_, center) == key_) addPieces(quarter, frame, params, pieces_);
  }
}

void RegionCover::addRectangle(const Cuboid& cuboid, const HalfCellRectangle& place,
                               const SurfaceBand& band, bool may_go) {
  const Eigen::AlignedBox3d around = boundsOf(cuboid, map_.resolution());
  const bool inside = (around.min().array() > bounds_.min().array()).all() &&
                      (around.max().array() < bounds_.max().array()).all();
  if (inside && may_go) {
    replaceable_.push_back({cuboid, {}});
    if (effort_ == CoverEffort::Quick) return;
    const PlaneLayer& plane = *near_.back();
    replaceable_.back().pieces =
        piecesOf(place, plane.raster, plane.frame(), band, map_.params.approximation);
  } else if (around.intersects(bounds_)) {
    present_.push_back(cuboid);
  }
}

std::vector<Cuboid> RegionCover::boxes() {
  const CuboidApproximationParams& params = map_.params.approximation;
  const std::size_t region = map_.cells.regions.indexOf(key_);
  std::vector<NonPlanarCell> cells;
  if (region != KeyMap<CellLayer::Region>::kNone) cells = map_.cells.cellsOf(region, params);
  if (!map_.isCompact()) {
    const std::uint32_t frame = map_.cells.regions.value(region).frame;
    const Vector3 sensor =
        frame < map_.trajectory.size() ? map_.trajectory[frame].position : Vector3(Vector3::Zero());
    return cuboidsOfCells(std::move(cells), params, sensor);
  }
  if (effort_ == CoverEffort::Quick) {
    for (const ReplaceableCuboid& r : replaceable_) present_.push_back(r.cuboid);
    replaceable_.clear();
  }
  BoxCover cover = coverWithBoxes(cells, pieces_, present_, replaceable_, params, effort_);
  for (std::size_t i = 0; i < cover.kept.size(); ++i) choices_[i].replaced = cover.kept[i] == 0;
  is_clutter_ = cover.is_clutter;
  is_provisional_ = effort_ == CoverEffort::Quick &&
                    (!choices_.empty() || (cover.boxes.size() > 1 && !is_clutter_));
  namePlanes(map_, near_, cover.boxes);
  return std::move(cover.boxes);
}

std::vector<std::uint64_t> regionsOf(const MapData& map, const PlaneFrame& frame,
                                     const PatchCover& cover) {
  std::vector<std::uint64_t> regions;
  if (!map.isCompact()) return regions;
  const double s = map.resolution();
  const SurfaceBand band = surfaceBand(map, cover.spread);
  for (const PatchCover::Rectangle& r : cover.rectangles) {
    const Cuboid cuboid = cuboidOf(r.place, frame, band, map.params.approximation);
    const Eigen::AlignedBox3d around = boundsOf(cuboid, s);  // so far it stands for what is there
    forEachPlace(unpackKey(regionOf(map, around.min())), unpackKey(regionOf(map, around.max())),
                 [&](const Int3& at) { regions.push_back(packKey(at)); });
  }
  for (const LooseQuarter& quarter : cover.loose) {
    const std::uint64_t key = regionOf(map, centerOf(quarter, frame, s));
    if (regions.empty() || regions.back() != key) regions.push_back(key);
  }
  std::sort(regions.begin(), regions.end());
  regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
  regions.shrink_to_fit();
  return regions;
}

}  // namespace planar_mapping::detail
