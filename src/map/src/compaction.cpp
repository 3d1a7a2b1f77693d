// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "compaction.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "box_planes.h"
#include "patch_cover.h"
#include "planar_mapping/core/parallel.h"

namespace planar_mapping::detail {
namespace {

Vector3 centerOf(const LooseQuarter& quarter, const PlaneFrame& frame, double s) {
  return frame.fromPlane({0.5 * s * (quarter.a + 0.5), 0.5 * s * (quarter.b + 0.5), 0.0});
}

/// The block of cells around a point, within the lattice.
Int3 blockOf(const Vector3& point, double s) {
  constexpr double kLimit = kLatticeLimit / 4;
  const Vector3 at = (point / (4.0 * s)).array().floor().max(-kLimit).min(kLimit - 1.0);
  return {static_cast<std::int32_t>(at.x()), static_cast<std::int32_t>(at.y()),
          static_cast<std::int32_t>(at.z())};
}

/// Half the world extent of a cuboid, and so far around it that it stands for what is there.
Vector3 halfExtent(const Cuboid& cuboid, double margin) {
  return cuboid.orientation.toRotationMatrix().cwiseAbs() * (0.5 * cuboid.size) +
         Vector3::Constant(margin);
}

}  // namespace

Compaction::Plane* Compaction::find(std::int32_t id) {
  const auto at = std::lower_bound(planes_.begin(), planes_.end(), id,
                                   [](const Plane& p, std::int32_t i) { return p.id < i; });
  return at != planes_.end() && at->id == id ? &*at : nullptr;
}

void Compaction::Patch::setCover(const SurfaceCover& cover) {
  std::vector<PatchRectangle> covered;
  for (std::size_t r = 0; r < cover.rectangles.size(); ++r) {
    covered.push_back({cover.rectangles[r], cover.probability[r], false});
  }
  rectangles = covered;
  loose = cover.loose;
}

void Compaction::findRegions(const MapData& map, const PlaneFrame& frame, const SurfaceBand& band,
                             Patch& patch) const {
  patch.regions = {};
  for (PatchRectangle& r : patch.rectangles) r.replaced = false;
  if (!map.isCompact()) return;
  const double s = map.resolution();
  std::vector<std::uint64_t> regions;
  for (const PatchRectangle& r : patch.rectangles) {
    const Cuboid cuboid = cuboidOf(r.rectangle, frame, band, map.params.approximation);
    const Vector3 half = halfExtent(cuboid, s);
    const Int3 low = unpackKey(map.cells.regionKey(blockOf(cuboid.center - half, s)));
    const Int3 high = unpackKey(map.cells.regionKey(blockOf(cuboid.center + half, s)));
    for (std::int32_t z = low.z; z <= high.z; ++z) {
      for (std::int32_t y = low.y; y <= high.y; ++y) {
        for (std::int32_t x = low.x; x <= high.x; ++x) {
          regions.push_back(packKey(Int3{x, y, z}));
        }
      }
    }
  }
  for (const LooseQuarter& quarter : patch.loose) {
    const std::uint64_t key = map.cells.regionKey(blockOf(centerOf(quarter, frame, s), s));
    if (regions.empty() || regions.back() != key) regions.push_back(key);
  }
  std::sort(regions.begin(), regions.end());
  regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
  patch.regions = regions;
}

bool Compaction::updatePlane(const MapData& map, std::size_t position,
                             std::vector<ChangedPatch>& changes) {
  const PlaneLayer& layer = map.planes[position];
  Plane& plane = planes_[position];
  const SurfaceBand band = surfaceBand(map, layer.stored.fit().moments);
  const bool moved = plane.frame_revision != layer.frame_revision || !(plane.band == band);
  plane.frame_revision = layer.frame_revision;
  plane.band = band;
  std::vector<std::size_t> changed;
  for (std::size_t p = 0; p < layer.patches.size(); ++p) {
    const Patch* patch = plane.patches.find(layer.patches.key(p));
    if (patch == nullptr || patch->revision != layer.patches.value(p).revision) {
      changed.push_back(p);
    }
  }
  const auto isGone = [&](std::uint64_t key, const Patch&) {
    return layer.patches.find(key) == nullptr;
  };
  for (std::size_t p = 0; p < plane.patches.size(); ++p) {
    const Patch& patch = plane.patches.value(p);
    if (moved || isGone(plane.patches.key(p), patch)) markRegions(patch);
  }
  plane.patches.removeIf(isGone);
  std::vector<std::vector<PlacedTile>> tiles = layer.tilesOf(changed);
  for (std::size_t i = 0; i < changed.size(); ++i) {
    const std::uint64_t key = layer.patches.key(changed[i]);
    Patch& patch = plane.patches[key];
    markRegions(patch);
    patch.revision = layer.patches.value(changed[i]).revision;
    changes.push_back({position, key, std::move(tiles[i]), {}});
  }
  return moved;
}

void Compaction::placePatches(const MapData& map, const std::vector<char>& moved,
                              std::vector<ChangedPatch>& changes) {
  const auto place = [&](std::size_t position, std::uint64_t key, Patch& patch) {
    const Plane& plane = planes_[position];
    findRegions(map, map.planes[position].stored.frame(), plane.band, patch);
    for (const std::uint64_t region : patch.regions) {
      regions_[region].dirty = true;
      regions_[region].patches.emplace_back(plane.id, key);
    }
  };
  for (ChangedPatch& change : changes) {
    Patch& patch = *planes_[change.plane].patches.find(change.key);
    patch.setCover(change.cover);
    if (moved[change.plane] == 0) place(change.plane, change.key, patch);
  }
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    Plane& plane = planes_[i];
    for (std::size_t p = 0; moved[i] != 0 && p < plane.patches.size(); ++p) {
      place(i, plane.patches.key(p), plane.patches.value(p));
    }
  }
}

void Compaction::coverRegion(const MapData& map, std::uint64_t key, Region& region) {
  const CuboidApproximationParams& params = map.params.approximation;
  const double s = params.resolution;
  const CellLayer::Region* cells = map.cells.regions.find(key);
  if (!map.isCompact()) {
    const Vector3 sensor = cells->frame < map.trajectory.size()
                               ? map.trajectory.at(cells->frame).sensor()
                               : Vector3(Vector3::Zero());
    region.listed = 0;
    region.cuboids = cuboidsOfCells(map.cells.cellsOf(*cells, params), params, sensor);
    return;
  }
  std::sort(region.patches.begin(), region.patches.end());
  region.patches.erase(std::unique(region.patches.begin(), region.patches.end()),
                       region.patches.end());
  const Int3 at = unpackKey(key);
  const Vector3 low = s * (Vector3(map.cells.anchor.x, map.cells.anchor.y, map.cells.anchor.z) +
                           kRegionCells * Vector3(at.x, at.y, at.z));
  const Vector3 high = low + Vector3::Constant(kRegionCells * s);
  std::vector<SurfacePiece> pieces;
  std::vector<Cuboid> present;
  std::vector<ReplaceableCuboid> replaceable;
  std::vector<bool*> replaced;  // of each of them
  std::vector<const PlaneLayer*> layers;
  const auto isOutdated = [&](const std::pair<std::int32_t, std::uint64_t>& name) {
    Plane* plane = find(name.first);
    const Patch* patch = plane == nullptr ? nullptr : plane->patches.find(name.second);
    return patch == nullptr ||
           !std::binary_search(patch->regions.begin(), patch->regions.end(), key);
  };
  region.patches.erase(std::remove_if(region.patches.begin(), region.patches.end(), isOutdated),
                       region.patches.end());
  for (const auto& [id, patch_key] : region.patches) {
    Plane& plane = *find(id);
    const PlaneLayer& layer = map.planes[static_cast<std::size_t>(&plane - planes_.data())];
    if (layers.empty() || layers.back() != &layer) layers.push_back(&layer);
    const PlaneFrame frame = layer.stored.frame();
    Patch& patch = *plane.patches.find(patch_key);
    std::vector<HalfCellRectangle> rectangles;
    for (const PatchRectangle& r : patch.rectangles) rectangles.push_back(r.rectangle);
    const std::vector<std::uint8_t> may_go = replaceableOf(rectangles, params);
    for (std::size_t r = 0; r < rectangles.size(); ++r) {
      const HalfCellRectangle& rectangle = rectangles[r];
      const Cuboid cuboid = cuboidOf(rectangle, frame, plane.band, params);
      const Vector3 half = halfExtent(cuboid, s);
      const Vector3 from = cuboid.center - half;
      const Vector3 to = cuboid.center + half;
      const bool inside = (from.array() > low.array()).all() && (to.array() < high.array()).all();
      if (inside && may_go[r] != 0) {
        replaceable.push_back(
            {cuboid, piecesOf(rectangle, layer.tiles, frame, plane.band, params)});
        replaced.push_back(&patch.rectangles[r].replaced);
      } else if ((from.array() <= high.array()).all() && (to.array() >= low.array()).all()) {
        present.push_back(cuboid);
      }
    }
    for (const LooseQuarter& quarter : patch.loose) {
      const Vector3 center = centerOf(quarter, frame, s);
      if (map.cells.regionKey(blockOf(center, s)) != key) continue;
      addPieces(quarter, frame, params, pieces);
    }
  }
  std::vector<NonPlanarCell> rest;
  if (cells != nullptr) rest = map.cells.cellsOf(*cells, params);
  region.patches.shrink_to_fit();
  region.listed = 0;
  RestCover cover = coverRest(rest, pieces, present, replaceable, params);
  region.cuboids = std::move(cover.boxes);
  for (std::size_t i = 0; i < replaced.size(); ++i) *replaced[i] = cover.kept[i] == 0;
  namePlanes(map, layers, region.cuboids);
}

void Compaction::update(const MapData& map) {
  if (!(anchor_ == map.cells.anchor)) {
    *this = Compaction();
    anchor_ = map.cells.anchor;
  }
  std::vector<Plane> planes;
  planes.reserve(map.planes.size());
  auto old = planes_.begin();
  for (const PlaneLayer& layer : map.planes) {
    for (; old != planes_.end() && old->id < layer.id; ++old) {
      for (std::size_t p = 0; p < old->patches.size(); ++p) markRegions(old->patches.value(p));
    }
    if (old != planes_.end() && old->id == layer.id) {
      planes.push_back(std::move(*old++));
    } else {
      planes.emplace_back();
      planes.back().id = layer.id;
      planes.back().frame_revision = layer.frame_revision;
      planes.back().band = surfaceBand(map, layer.stored.fit().moments);
    }
  }
  for (; old != planes_.end(); ++old) {
    for (std::size_t p = 0; p < old->patches.size(); ++p) markRegions(old->patches.value(p));
  }
  planes_ = std::move(planes);

  const int threads = map.params.approximation.threads;
  std::vector<ChangedPatch> changes;
  std::vector<char> moved(planes_.size());
  for (std::size_t i = 0; i < planes_.size(); ++i) moved[i] = updatePlane(map, i, changes) ? 1 : 0;
  parallelFor(changes.size(), threads, [&](std::size_t i) {
    changes[i].cover = coverPatch(changes[i].tiles, map.params.approximation);
  });
  placePatches(map, moved, changes);

  for (std::size_t r = 0; r < map.cells.regions.size(); ++r) {
    Region& region = regions_[map.cells.regions.key(r)];
    const std::uint32_t revision = map.cells.regions.value(r).revision;
    region.dirty |= region.revision != revision;
    region.revision = revision;
  }
  std::vector<std::size_t> dirty;
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    Region& region = regions_.value(r);
    const std::uint64_t key = regions_.key(r);
    // A region whose last cell is gone has no revision of its own any more.
    region.dirty |= region.revision != 0 && map.cells.regions.find(key) == nullptr;
    if (!region.dirty) continue;
    region.dirty = false;
    if (map.cells.regions.find(key) == nullptr) {
      region.revision = 0;
      if (!map.isCompact()) {
        region.cuboids.clear();
        region.listed = 0;
        continue;
      }
    }
    dirty.push_back(r);
  }
  // A rectangle that may be replaced lies within one region: no two write about the same one.
  parallelFor(dirty.size(), threads, [&](std::size_t i) {
    coverRegion(map, regions_.key(dirty[i]), regions_.value(dirty[i]));
  });
  regions_.removeIf([](std::uint64_t, const Region& region) {
    return region.revision == 0 && region.patches.empty();
  });
  count_ = 0;
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    count_ += regions_.value(r).cuboids.size() + regions_.value(r).listed;
  }
  for (const Plane& plane : planes_) {
    for (std::size_t p = 0; p < plane.patches.size(); ++p) {
      const TightList<PatchRectangle>& all = plane.patches.value(p).rectangles;
      count_ += static_cast<std::size_t>(std::count_if(
          all.begin(), all.end(), [](const PatchRectangle& r) { return !r.replaced; }));
    }
  }
}

const std::vector<Cuboid>& Compaction::makeList(const MapData& map) {
  std::vector<Cuboid> all;
  all.reserve(count_);
  // Patches and regions by key: their order in the hash is that of insertion.
  const auto inOrder = [](auto& parts, auto&& visit) {
    std::vector<std::uint64_t> keys = parts.keys();
    std::sort(keys.begin(), keys.end());
    for (const std::uint64_t key : keys) visit(*parts.find(key));
  };
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const Plane& plane = planes_[i];
    const PlaneFrame frame = map.planes[i].stored.frame();
    inOrder(plane.patches, [&](const Patch& patch) {
      for (const PatchRectangle& r : patch.rectangles) {
        if (r.replaced) continue;
        Cuboid cuboid = cuboidOf(r.rectangle, frame, plane.band, map.params.approximation);
        cuboid.plane_id = plane.id;
        cuboid.probability = r.probability;
        all.push_back(cuboid);
      }
    });
  }
  inOrder(regions_, [&](Region& region) {
    const auto at = static_cast<std::uint32_t>(all.size());
    const auto listed = list_.begin() + region.first;
    all.insert(all.end(), listed, listed + region.listed);
    all.insert(all.end(), region.cuboids.begin(), region.cuboids.end());
    region.first = at;
    region.listed = static_cast<std::uint32_t>(all.size()) - at;
    region.cuboids = std::vector<Cuboid>();
  });
  list_ = std::move(all);
  return list_;
}

std::size_t Compaction::memoryBytes() const {
  std::size_t bytes = planes_.capacity() * sizeof(Plane) + regions_.memoryBytes() +
                      list_.capacity() * sizeof(Cuboid);
  for (const Plane& plane : planes_) {
    bytes += plane.patches.memoryBytes();
    for (std::size_t p = 0; p < plane.patches.size(); ++p) {
      const Patch& patch = plane.patches.value(p);
      bytes +=
          patch.rectangles.memoryBytes() + patch.loose.memoryBytes() + patch.regions.memoryBytes();
    }
  }
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    const Region& region = regions_.value(r);
    bytes += region.cuboids.capacity() * sizeof(Cuboid) +
             region.patches.capacity() * sizeof(region.patches[0]);
  }
  return bytes;
}

}  // namespace planar_mapping::detail
