// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/compaction.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "cuboids/patch_cover.h"
#include "planar_mapping/core/base/detail/parallel.h"
#include "store/surface_band.h"

namespace planar_mapping::detail {

std::vector<Compaction::Slot> Compaction::matchCovers(const MapData& map, const Planes& planes,
                                                      const Records& before) {
  std::vector<Slot> slots;
  std::size_t next = 0;
  const auto giveUp = [&] { markRegions(PackedCover(before[next++]).regions()); };
  for (std::size_t position = 0; position < planes.size(); ++position) {
    const PlaneLayer& layer = planes[position];
    const std::uint8_t spread = surfaceSpread(map, layer.state().stored.fit().moments);
    for (std::size_t p = 0; p < layer.raster().patches(); ++p) {
      Slot slot;
      slot.position = position;
      slot.patch = p;
      slot.cover.plane = layer.id;
      slot.cover.key = layer.raster().key(p);
      slot.cover.revision = layer.raster().revision(p);
      slot.cover.frame_revision = layer.state().frame_revision;
      slot.cover.spread = spread;
      const auto name = [](const PatchCover& cover) { return std::tie(cover.plane, cover.key); };
      PatchCover made;
      for (; next < before.size(); giveUp()) {
        made = PackedCover(before[next]).head();
        if (!(name(made) < name(slot.cover))) break;
      }
      if (next < before.size() && name(made) == name(slot.cover)) {
        slot.before = next;
        slot.covered = made.revision == slot.cover.revision;
        slot.placed = made.frame_revision == slot.cover.frame_revision && made.spread == spread;
        if (slot.covered && slot.placed) {
          ++next;
        } else {
          giveUp();
        }
      } else {
        slot.covered = slot.placed = false;
      }
      slots.push_back(std::move(slot));
    }
  }
  while (next < before.size()) giveUp();
  return slots;
}

void Compaction::makeCovers(const MapData& map, const Planes& planes, const Records& before,
                            std::vector<Slot>& slots) {
  std::vector<Slot*> changed;
  for (Slot& slot : slots) {
    if (!slot.covered || !slot.placed) changed.push_back(&slot);
  }
  const CuboidApproximationParams& params = map.params.approximation;
  parallelFor(changed.size(), params.threads, [&](std::size_t i) {
    const Slot& slot = *changed[i];
    PatchCover& cover = changed[i]->cover;
    const PlaneLayer& layer = planes[slot.position];
    if (slot.covered) {
      PatchCover made = PackedCover(before[slot.before]).unpacked();
      cover.rectangles = std::move(made.rectangles);
      cover.loose = std::move(made.loose);
    } else {
      const OpenRaster raster = layer.raster().reopened();
      const SurfaceCover made = coverPatch(raster.tilesOf(slot.patch), params);
      for (std::size_t r = 0; r < made.rectangles.size(); ++r) {
        cover.rectangles.push_back({made.rectangles[r], made.probability[r]});
      }
      cover.loose = made.loose;
    }
    cover.regions = regionsOf(map, layer.state().stored.frame(), cover);
  });
  for (const Slot* slot : changed) markRegions(slot->cover.regions);
}

void Compaction::coverRegion(const MapData& map, const Planes& planes,
                             const std::vector<Slot>& slots, const Records& covers,
                             const RegionTask& task) {
  RegionCover cover(map, regions_.key(task.region), task.effort);
  for (const std::uint32_t c : task.near) {
    cover.add(c, planes[slots[c].position], PackedCover(covers[c]).unpacked());
  }
  Region& region = regions_.value(task.region);
  region.boxes = ListedBoxes(cover.boxes(), map.resolution());
  region.provisional = cover.isProvisional();
  for (const RegionCover::Choice& choice : cover.choices()) {
    const PackedRecords::Record& record = covers[choice.cover];
    PackedCover::setReplaced(covers_.bytesOf(record), record.size, choice.rectangle,
                             choice.replaced);
  }
}

void Compaction::coverRegions(const MapData& map, const Planes& planes,
                              const std::vector<Slot>& slots, CoverEffort effort) {
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
    const Region& region = regions_.value(r);
    if (region.dirty || region.provisional) changed.push_back(regions_.key(r));
  }
  if (map.isCompact()) separate(changed, map.resolution());
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    Region& region = regions_.value(r);
    if (!region.dirty && !region.provisional) continue;
    const bool is_quick = region.dirty && effort == CoverEffort::Quick;
    region.dirty = region.provisional = false;
    region.boxes = ListedBoxes();
    if (!map.isCompact() && has_cells[r] == 0) continue;
    task_of[r] = tasks.size();
    tasks.push_back({r, is_quick ? CoverEffort::Quick : CoverEffort::Full, {}});
  }
  const Records covers = covers_.list();
  std::vector<char> is_covered(regions_.size());
  for (std::uint32_t c = 0; c < covers.size(); ++c) {
    for (const std::uint64_t key : PackedCover(covers[c]).regions()) {
      const std::size_t r = regions_.indexOf(key);
      is_covered[r] = 1;
      if (task_of[r] != kNoTask) tasks[task_of[r]].near.push_back(c);
    }
  }
  // A rectangle that may be replaced lies within one region: no two write about the same one.
  parallelFor(tasks.size(), map.params.approximation.threads,
              [&](std::size_t i) { coverRegion(map, planes, slots, covers, tasks[i]); });
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
  const Planes planes = map.resting.open();
  const Records before = covers_.list();
  std::vector<Slot> slots = matchCovers(map, planes, before);
  makeCovers(map, planes, before, slots);
  PackedRecords::Change change(before);
  for (const Slot& slot : slots) {
    if (slot.covered && slot.placed) {
      change.keep(slot.before);
    } else {
      change.put(packCover(slot.cover));
    }
  }
  covers_.apply(change);
  coverRegions(map, planes, slots, effort);
  if (effort == CoverEffort::Full && map.isCompact()) joinRegions(map, planes, slots);
  count_ = joined_.size();
  settled_ = joined_.isComplete();
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    const Region& region = regions_.value(r);
    count_ += region.boxes.size();
    settled_ &= !region.provisional;
  }
  for (const PackedRecords::Record& cover : covers_.list()) count_ += PackedCover(cover).count();
}

/// By key: their order in the hash is that of insertion.
std::vector<std::uint64_t> Compaction::sortedRegions() const {
  std::vector<std::uint64_t> keys = regions_.keys();
  std::sort(keys.begin(), keys.end());
  return keys;
}

void Compaction::joinRegions(const MapData& map, const Planes& planes,
                             const std::vector<Slot>& slots) {
  if (joined_.isComplete()) return;
  std::vector<JoinedBoxes::PlacedBox> boxes;
  for (const std::uint64_t key : sortedRegions()) {
    std::uint32_t number = 0;
    for (const Cuboid& box : regions_.find(key)->boxes.unpacked(list_, map.resolution())) {
      boxes.push_back({{key, number++}, box});
    }
  }
  const Records covers = covers_.list();
  KeyMap<std::vector<std::uint32_t>> covers_in;
  for (std::uint32_t c = 0; c < covers.size(); ++c) {
    for (const std::uint64_t key : PackedCover(covers[c]).regions()) covers_in[key].push_back(c);
  }
  const auto coverGroup = [&](GroupCover& group) {
    std::vector<std::uint32_t> near;
    for (const std::uint64_t key : group.regions()) {
      const std::size_t r = covers_in.indexOf(key);
      if (r == KeyMap<Region>::kNone) continue;
      near.insert(near.end(), covers_in.value(r).begin(), covers_in.value(r).end());
    }
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    for (const std::uint32_t c : near) {
      group.add(planes[slots[c].position], PackedCover(covers[c]));
    }
    return group.run();
  };
  const std::vector<RegionBox> joined = joined_.join(map, boxes, list_, coverGroup);
  for (auto next = joined.begin(); next != joined.end();) {
    Region& region = *regions_.find(next->region);
    const std::vector<Cuboid> all = region.boxes.unpacked(list_, map.resolution());
    std::vector<Cuboid> left;
    for (RegionBox box{next->region, 0}; box.number < all.size(); ++box.number) {
      if (next != joined.end() && *next == box) {
        ++next;
      } else {
        left.push_back(all[box.number]);
      }
    }
    region.boxes = ListedBoxes(left, map.resolution());
  }
}

void Compaction::separate(const std::vector<std::uint64_t>& changed, double cell) {
  const std::vector<JoinedBoxes::PlacedBox> released = joined_.release(changed, list_, cell);
  for (auto next = released.begin(); next != released.end();) {
    const std::uint64_t key = next->first.region;
    Region& region = *regions_.find(key);
    std::vector<Cuboid> all = region.boxes.unpacked(list_, cell);
    for (; next != released.end() && next->first.region == key; ++next) {
      all.insert(all.begin() + next->first.number, next->second);
    }
    region.boxes = ListedBoxes(all, cell);
  }
}

const std::vector<Cuboid>& Compaction::makeList(const MapData& map) {
  std::vector<Cuboid> all;
  all.reserve(count_);
  const Planes planes = map.resting.open();
  auto plane = planes.begin();
  PlaneFrame frame;
  for (const PackedRecords::Record& record : covers_.list()) {
    const PackedCover packed(record);
    const PatchCover cover = packed.unpacked();
    if (all.empty() || plane->id != cover.plane) {
      while (plane->id != cover.plane) ++plane;
      frame = plane->state().stored.frame();
    }
    const SurfaceBand band = surfaceBand(map, cover.spread);
    for (std::size_t i = 0; i < cover.rectangles.size(); ++i) {
      if (packed.isReplaced(i)) continue;
      const PatchCover::Rectangle& r = cover.rectangles[i];
      Cuboid cuboid = cuboidOf(r.place, frame, band, map.params.approximation);
      cuboid.plane_id = cover.plane;
      cuboid.probability = r.probability;
      all.push_back(cuboid);
    }
  }
  for (const std::uint64_t key : sortedRegions()) {
    regions_.find(key)->boxes.moveTo(all, list_, map.resolution());
  }
  joined_.moveTo(all, list_, map.resolution());
  list_ = std::move(all);
  return list_;
}

std::size_t Compaction::memoryBytes() const {
  std::size_t bytes =
      covers_.memoryBytes() + regions_.memoryBytes() + joined_.memoryBytes() + heapBytes(list_);
  for (std::size_t r = 0; r < regions_.size(); ++r) bytes += regions_.value(r).boxes.memoryBytes();
  return bytes;
}

}  // namespace planar_mapping::detail
