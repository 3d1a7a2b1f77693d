// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/group_cover.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cuboids/cover_geometry.h"
#include "store/surface_band.h"

namespace planar_mapping::detail {
namespace {

/// Cells so far from a box have to do with it: it stands for what is half a cell beside it, and may
/// become one that holds another half.
constexpr double kReach = 2.0;

void makeDistinct(std::vector<std::uint64_t>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

}  // namespace

GroupCover::GroupCover(const MapData& map, std::vector<Cuboid> boxes)
    : map_(map), boxes_(std::move(boxes)) {
  const double s = map.resolution();
  for (const Cuboid& box : boxes_) {
    const Eigen::AlignedBox3d around = boundsOf(box, kReach * s);
    bounds_.extend(around);
    forEachPlace(blockOf(around.min(), s), blockOf(around.max(), s),
                 [&](const Int3& block) { blocks_.push_back(packKey(block)); });
  }
  makeDistinct(blocks_);
  for (const std::uint64_t block : blocks_) {
    const std::uint64_t region = map.cells.regionKey(unpackKey(block));
    if (regions_.empty() || regions_.back() != region) regions_.push_back(region);
  }
  makeDistinct(regions_);
}

bool GroupCover::isNear(const Int3& block) const {
  return std::binary_search(blocks_.begin(), blocks_.end(), packKey(block));
}

void GroupCover::add(const PlaneLayer& plane, const PatchCover& cover) {
  const CuboidApproximationParams& params = map_.params.approximation;
  const double s = map_.resolution();
  const SurfaceBand band = surfaceBand(map_, cover.spread);
  if (near_.empty() || near_.back() != &plane) near_.push_back(&plane);
  const PlaneFrame& frame = plane.frame();
  for (const PatchCover::Rectangle& rectangle : cover.rectangles) {
    const Cuboid cuboid = cuboidOf(rectangle.place, frame, band, params);
    if (!boundsOf(cuboid, s).intersects(bounds_)) continue;
    if (!rectangle.replaced) {
      present_.push_back(cuboid);
      continue;
    }
    for (const SurfacePiece& piece : piecesOf(rectangle.place, plane.raster, frame, band, params)) {
      if (isNear(blockOf(piece.center, s))) pieces_.push_back(piece);
    }
  }
  for (const LooseQuarter& quarter : cover.loose) {
    if (!isNear(blockOf(centerOf(quarter, frame, s), s))) continue;
    addPieces(quarter, frame, params, pieces_);
  }
}

std::vector<NonPlanarCell> GroupCover::cells() const {
  std::vector<NonPlanarCell> cells;
  for (const std::uint64_t key : regions_) {
    const std::size_t region = map_.cells.regions.indexOf(key);
    if (region == KeyMap<CellLayer::Region>::kNone) continue;
    for (const NonPlanarCell& cell : map_.cells.cellsOf(region, map_.params.approximation)) {
      if (isNear(CellLayer::blockOf({cell.x, cell.y, cell.z}))) cells.push_back(cell);
    }
  }
  return cells;
}

bool GroupCover::run() {
  std::vector<Cuboid> again =
      coverAgain(boxes_, cells(), pieces_, present_, map_.params.approximation);
  if (again.size() >= boxes_.size()) return false;
  namePlanes(map_, near_, again);
  boxes_ = std::move(again);
  return true;
}

}  // namespace planar_mapping::detail
