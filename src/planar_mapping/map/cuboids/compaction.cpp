// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/cuboids/compaction.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "planar_mapping/base/lists.h"
#include "planar_mapping/base/parallel.h"
#include "planar_mapping/map/cuboids/cover_geometry.h"
#include "planar_mapping/map/store/surface_band.h"

namespace planar_mapping::detail {
namespace {

/// Regions in which the cover has or absorbs something, ascending.
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
  makeDistinct(regions);
  regions.shrink_to_fit();
  return regions;
}

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

  /// \param effort  quick: all rectangles stay
  RegionCover(const MapData& map, std::uint64_t key, CoverEffort effort)
      : map_(map), key_(key), effort_(effort) {
    const double s = map.resolution();
    const Int3& anchor = map.cells.anchor;
    const Int3 at = unpackKey(key);
    const Vector3 low =
        s * (Vector3(anchor.x, anchor.y, anchor.z) + kRegionCells * Vector3(at.x, at.y, at.z));
    bounds_ = {low, low + Vector3::Constant(kRegionCells * s)};
  }

  /// Adds a cover of which something is in the region or near it. Those of a plane come together.
  void add(std::uint32_t number, const PlaneLayer& plane, const PatchCover& cover) {
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
      if (replaceable_.size() > before) choices.push_back({number, r, false});
    }
    for (const LooseQuarter& quarter : cover.loose) {
      const Vector3 center = centerOf(quarter, frame, map_.resolution());
      if (regionOf(map_, center) == key_) addPieces(quarter, frame, params, pieces_);
    }
  }

  /// Makes the boxes of what was added.
  std::vector<Cuboid> boxes() {
    const CuboidApproximationParams& params = map_.params.approximation;
    const std::size_t region = map_.cells.regions.indexOf(key_);
    std::vector<NonPlanarCell> cells;
    if (region != KeyMap<CellLayer::Region>::kNone) cells = map_.cells.cellsOf(region, params);
    if (!map_.isCompact()) {
      const std::uint32_t frame = map_.cells.regions.value(region).frame;
      const Vector3 sensor = frame < map_.trajectory.size() ? map_.trajectory[frame].position
                                                            : Vector3(Vector3::Zero());
      return cuboidsOfCells(std::move(cells), params, sensor);
    }
    if (effort_ == CoverEffort::Quick) {
      for (const ReplaceableCuboid& r : replaceable_) present_.push_back(r.cuboid);
      replaceable_.clear();
    }
    BoxCover cover = coverWithBoxes(cells, pieces_, present_, replaceable_, params, effort_);
    for (std::size_t i = 0; i < cover.kept.size(); ++i) choices[i].replaced = cover.kept[i] == 0;
    is_clutter = cover.is_clutter;
    is_provisional = effort_ == CoverEffort::Quick &&
                     (!choices.empty() || (cover.boxes.size() > 1 && !is_clutter));
    namePlanes(map_, near_, cover.boxes);
    return std::move(cover.boxes);
  }

  // As of boxes():
  std::vector<Choice> choices;  ///< of each replaceable rectangle
  bool is_provisional = false;  ///< more effort may need fewer cuboids
  bool is_clutter = false;

 private:
  void addRectangle(const Cuboid& cuboid, const HalfCellRectangle& place, const SurfaceBand& band,
                    bool may_go) {
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

  const MapData& map_;
  const std::uint64_t key_;
  const CoverEffort effort_;
  Eigen::AlignedBox3d bounds_;  ///< of the region
  std::vector<const PlaneLayer*> near_;
  std::vector<SurfacePiece> pieces_;
  std::vector<Cuboid> present_;
  std::vector<ReplaceableCuboid> replaceable_;
};

}  // namespace

/// Derives the covers of patches that changed or moved; marks the regions they are and were in.
void Compaction::updateCovers(const MapData& map) {
  struct Task {
    std::size_t cover;
    const PlaneLayer* layer;
    const RasterPatch* patch;
    bool same_cells;
  };
  std::vector<Task> tasks;
  std::vector<PatchCover> before = std::exchange(covers_, {});
  auto next = before.begin();
  for (const PlaneLayer& layer : map.planes) {
    const std::uint8_t spread = surfaceSpread(map, layer.moments());
    for (const RasterPatch& patch : layer.raster.patches()) {
      const auto isBefore = [&](const PatchCover& cover) {
        return std::tie(cover.plane, cover.key) < std::tie(layer.id, patch.key);
      };
      for (; next != before.end() && isBefore(*next); ++next) markRegions(next->regions);
      const bool known = next != before.end() && next->plane == layer.id && next->key == patch.key;
      PatchCover cover = known ? std::move(*next++) : PatchCover();
      const bool same_cells = known && cover.revision == patch.revision;
      const bool same_place =
          known && cover.frame_revision == layer.frameRevision() && cover.spread == spread;
      if (!same_cells || !same_place) {
        markRegions(cover.regions);
        tasks.push_back({covers_.size(), &layer, &patch, same_cells});
      }
      cover.plane = layer.id;
      cover.key = patch.key;
      cover.revision = patch.revision;
      cover.frame_revision = layer.frameRevision();
      cover.spread = spread;
      covers_.push_back(std::move(cover));
    }
  }
  for (; next != before.end(); ++next) markRegions(next->regions);

  const CuboidApproximationParams& params = map.params.approximation;
  parallelFor(tasks.size(), params.threads, [&](std::size_t i) {
    const Task& task = tasks[i];
    PatchCover& cover = covers_[task.cover];
    if (task.same_cells) {
      for (PatchCover::Rectangle& r : cover.rectangles) r.replaced = false;
    } else {
      const SurfaceCover made = coverPatch(task.layer->raster.tilesOf(*task.patch), params);
      cover.rectangles.clear();
      cover.rectangles.reserve(made.rectangles.size());
      for (std::size_t r = 0; r < made.rectangles.size(); ++r) {
        cover.rectangles.push_back({made.rectangles[r], made.probability[r], false});
      }
      cover.loose = made.loose;
    }
    cover.regions = regionsOf(map, task.layer->frame(), cover);
  });
  for (const Task& task : tasks) markRegions(covers_[task.cover].regions);
}

void Compaction::coverRegion(const MapData& map, const RegionTask& task) {
  RegionCover cover(map, regions_.key(task.region), task.effort);
  for (const std::uint32_t c : task.near) cover.add(c, map.plane(covers_[c].plane), covers_[c]);
  Region& region = regions_.value(task.region);
  region.setBoxes(cover.boxes());
  region.provisional = cover.is_provisional;
  region.is_clutter = cover.is_clutter;
  for (const RegionCover::Choice& choice : cover.choices) {
    covers_[choice.cover].rectangles[choice.rectangle].replaced = choice.replaced;
  }
}

void Compaction::coverRegions(const MapData& map, CoverEffort effort) {
  for (std::size_t r = 0; r < map.cells.regions.size(); ++r) {
    Region& region = regions_[map.cells.regions.key(r)];
    const std::uint32_t revision = map.cells.regions.value(r).revision;
    region.dirty |= region.revision != revision;
    region.revision = revision;
  }
  std::vector<char> has_cells(regions_.size());
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    Region& region = regions_.value(r);
    has_cells[r] = map.cells.regions.find(regions_.key(r)) != nullptr ? 1 : 0;
    // A region whose last cell is gone has no revision of its own any more.
    region.dirty |= region.revision != 0 && has_cells[r] == 0;
    if (has_cells[r] == 0) region.revision = 0;
  }
  constexpr auto kNoTask = static_cast<std::size_t>(-1);
  std::vector<RegionTask> tasks;
  std::vector<std::size_t> task_of(regions_.size(), kNoTask);
  std::vector<std::uint64_t> changed;
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    Region& region = regions_.value(r);
    if (!region.dirty && !region.provisional) continue;
    changed.push_back(regions_.key(r));
    const bool is_quick = region.dirty && effort == CoverEffort::Quick;
    region.dirty = region.provisional = false;
    region.setBoxes({});
    if (!map.isCompact() && has_cells[r] == 0) continue;
    task_of[r] = tasks.size();
    tasks.push_back({r, is_quick ? CoverEffort::Quick : CoverEffort::Full, {}});
  }
  if (map.isCompact() && !changed.empty()) {
    std::sort(changed.begin(), changed.end());
    joined_.release(changed);
    for (Region& region : regions_.values()) region.joined.assign(region.boxes.size(), 0);
  }
  std::vector<char> is_covered(regions_.size());
  for (std::uint32_t c = 0; c < covers_.size(); ++c) {
    for (const std::uint64_t key : covers_[c].regions) {
      const std::size_t r = regions_.indexOf(key);
      is_covered[r] = 1;
      if (task_of[r] != kNoTask) tasks[task_of[r]].near.push_back(c);
    }
  }
  // A rectangle that may be replaced lies within one region: no two write about the same one.
  parallelFor(tasks.size(), map.params.approximation.threads,
              [&](std::size_t i) { coverRegion(map, tasks[i]); });
  std::size_t at = 0;
  regions_.removeIf([&](std::uint64_t, const Region&) {
    const bool needed = has_cells[at] != 0 || is_covered[at] != 0;
    ++at;
    return !needed;
  });
}

void Compaction::update(const MapData& map, CoverEffort effort) {
  if (!(anchor_ == map.cells.anchor)) {
    *this = Compaction();
    anchor_ = map.cells.anchor;
  }
  updateCovers(map);
  coverRegions(map, effort);
  if (effort == CoverEffort::Full && map.isCompact()) joinRegions(map);
  count_ = joined_.size();
  settled_ = joined_.isComplete();
  for (const Region& region : regions_.values()) {
    count_ += static_cast<std::size_t>(std::count(region.joined.begin(), region.joined.end(), 0));
    settled_ &= !region.provisional;
  }
  for (const PatchCover& cover : covers_) count_ += cover.count();
}

void Compaction::joinRegions(const MapData& map) {
  if (joined_.isComplete()) return;
  std::vector<JoinedBoxes::PlacedBox> boxes;
  for (const std::uint64_t key : regions_.sortedKeys()) {
    const Region& region = *regions_.find(key);
    if (region.is_clutter) continue;
    std::uint32_t number = 0;
    for (const Cuboid& box : region.boxes) boxes.push_back({{key, number++}, box});
  }
  for (const RegionBox& box : joined_.join(map, boxes, covers_)) {
    regions_.find(box.region)->joined[box.number] = 1;
  }
}

const std::vector<Cuboid>& Compaction::makeList(const MapData& map) {
  list_.clear();
  list_.reserve(count_);
  for (const PatchCover& cover : covers_) {
    const PlaneFrame& frame = map.plane(cover.plane).frame();
    const SurfaceBand band = surfaceBand(map, cover.spread);
    for (const PatchCover::Rectangle& r : cover.rectangles) {
      if (r.replaced) continue;
      list_.push_back(cuboidOf(r.place, frame, band, map.params.approximation));
      list_.back().plane_id = cover.plane;
      list_.back().probability = r.probability;
    }
  }
  for (const std::uint64_t key : regions_.sortedKeys()) {
    const Region& region = *regions_.find(key);
    for (std::size_t i = 0; i < region.boxes.size(); ++i) {
      if (region.joined[i] == 0) list_.push_back(region.boxes[i]);
    }
  }
  joined_.appendTo(list_);
  return list_;
}

std::size_t Compaction::clutteredRegions() const {
  return static_cast<std::size_t>(
      std::count_if(regions_.values().begin(), regions_.values().end(),
                    [](const Region& region) { return region.is_clutter; }));
}

std::size_t Compaction::memoryBytes() const {
  std::size_t bytes = capacityBytes(covers_) + regions_.memoryBytes() + joined_.memoryBytes() +
                      capacityBytes(list_);
  for (const PatchCover& cover : covers_) bytes += cover.memoryBytes();
  for (const Region& region : regions_.values())
    bytes += capacityBytes(region.boxes) + capacityBytes(region.joined);
  return bytes;
}

}  // namespace planar_mapping::detail
