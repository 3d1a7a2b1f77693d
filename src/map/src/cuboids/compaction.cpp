// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/compaction.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "planar_mapping/core/base/detail/parallel.h"
#include "store/surface_band.h"

namespace planar_mapping::detail {

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
  region.provisional = cover.isProvisional();
  region.is_clutter = cover.isClutter();
  for (const RegionCover::Choice& choice : cover.choices()) {
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
  KeyMap<std::vector<std::uint32_t>> covers_in;
  for (std::uint32_t c = 0; c < covers_.size(); ++c) {
    for (const std::uint64_t key : covers_[c].regions) covers_in[key].push_back(c);
  }
  const auto coverGroup = [&](GroupCover& group) {
    std::vector<std::uint32_t> near;
    for (const std::uint64_t key : group.regions()) {
      const std::vector<std::uint32_t>* covers = covers_in.find(key);
      if (covers != nullptr) near.insert(near.end(), covers->begin(), covers->end());
    }
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    for (const std::uint32_t c : near) group.add(map.plane(covers_[c].plane), covers_[c]);
    return group.run();
  };
  for (const RegionBox& box : joined_.join(map, boxes, coverGroup)) {
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
