// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "plane_layer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "belief.h"

namespace planar_mapping::detail {
namespace {

constexpr std::int32_t kPatchTiles = kPatchCells / 8;

/// Bits of the columns [low, high] and rows [low, high] of a tile.
std::uint64_t tileRectangle(std::int32_t low_a, std::int32_t low_b, std::int32_t high_a,
                            std::int32_t high_b) {
  const std::uint64_t row = ((std::uint64_t{2} << high_a) - 1) & ~((std::uint64_t{1} << low_a) - 1);
  std::uint64_t bits = 0;
  for (std::int32_t b = low_b; b <= high_b; ++b) bits |= (row & 0xffu) << (8 * b);
  return bits;
}

}  // namespace

bool PlaneLayer::at(std::int32_t a, std::int32_t b) const {
  const RasterTile* tile = tiles.find(packKey(a >> 3, b >> 3));
  return tile != nullptr && ((tile->occupied() >> (8 * (b & 7) + (a & 7))) & 1u) != 0;
}

bool PlaneLayer::anyWithin(std::int32_t a, std::int32_t b, std::int32_t radius) const {
  const auto touches = [&](std::int32_t ta, std::int32_t tb, const RasterTile& tile) {
    const std::int32_t low_a = std::max(a - radius - 8 * ta, 0);
    const std::int32_t low_b = std::max(b - radius - 8 * tb, 0);
    const std::int32_t high_a = std::min(a + radius - 8 * ta, 7);
    const std::int32_t high_b = std::min(b + radius - 8 * tb, 7);
    return low_a <= high_a && low_b <= high_b &&
           (tile.occupied() & tileRectangle(low_a, low_b, high_a, high_b)) != 0;
  };
  const std::int64_t side = 2 * static_cast<std::int64_t>(radius) / 8 + 2;
  if (side * side > static_cast<std::int64_t>(tiles.size())) {
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      std::int32_t ta = 0, tb = 0;
      unpackKey(tiles.key(i), ta, tb);
      if (touches(ta, tb, tiles.value(i))) return true;
    }
    return false;
  }
  for (std::int32_t tb = (b - radius) >> 3; tb <= (b + radius) >> 3; ++tb) {
    for (std::int32_t ta = (a - radius) >> 3; ta <= (a + radius) >> 3; ++ta) {
      const RasterTile* tile = tiles.find(packKey(ta, tb));
      if (tile != nullptr && touches(ta, tb, *tile)) return true;
    }
  }
  return false;
}

void PlaneLayer::wake() {
  if (fit_ != nullptr) return;
  fit_.reset(new Fit);
  fit_->frame = stored.frame();
  fit_->plane = planeOf(fit_->frame);
}

const PlaneMoments& PlaneLayer::moments() const {
  if (!fit_->moments) fit_->moments = stored.moments(stored.frame());
  return *fit_->moments;
}

void PlaneLayer::setFrame(const PlaneFrame& wanted) {
  fit().frame = wanted;
  fit().plane = planeOf(wanted);
  settled_ = false;
}

void PlaneLayer::setMoments(const PlaneMoments& moments) {
  fit().moments = moments;
  settled_ = false;
}

void PlaneLayer::settle() {
  if (!settled_) restore(StoredPlane::from(frame(), moments()));
  fit_.reset();
}

void PlaneLayer::restore(const StoredPlane& plane) {
  if (!stored.hasFrameOf(plane)) ++frame_revision;
  stored = plane;
  fit_.reset();
  settled_ = true;
}

RasterTile& PlaneLayer::tileAt(std::int32_t tile_a, std::int32_t tile_b) {
  low_tile_a_ = std::min(low_tile_a_, tile_a);
  low_tile_b_ = std::min(low_tile_b_, tile_b);
  high_tile_a_ = std::max(high_tile_a_, tile_a);
  high_tile_b_ = std::max(high_tile_b_, tile_b);
  return tiles[packKey(tile_a, tile_b)];
}

bool PlaneLayer::extent(std::int32_t& low_a, std::int32_t& low_b, std::int32_t& high_a,
                        std::int32_t& high_b) const {
  if (low_tile_a_ > high_tile_a_) return false;
  low_a = 8 * low_tile_a_;
  low_b = 8 * low_tile_b_;
  high_a = 8 * high_tile_a_ + 7;
  high_b = 8 * high_tile_b_ + 7;
  return true;
}

bool PlaneLayer::bounds(double s, double thickness, Vector3& low, Vector3& high) const {
  std::int32_t low_a = 0, low_b = 0, high_a = 0, high_b = 0;
  if (!extent(low_a, low_b, high_a, high_b)) return false;
  const PlaneFrame& f = frame();
  const Vector3 middle = f.fromPlane(
      {0.5 * s * (low_a + high_a + 1), 0.5 * s * (low_b + high_b + 1), -0.5 * thickness});
  const Vector3 half = 0.5 * s * (high_a - low_a + 1) * f.u.cwiseAbs() +
                       0.5 * s * (high_b - low_b + 1) * f.v.cwiseAbs() +
                       0.5 * thickness * f.n.cwiseAbs();
  low = middle - half;
  high = middle + half;
  return true;
}

bool PlaneLayer::cellOf(const Vector3& point, double s, std::int32_t& a, std::int32_t& b) const {
  const PlaneFrame& f = frame();
  const Vector3 d = point - f.origin;
  const double u = std::floor(f.u.dot(d) / s);
  const double v = std::floor(f.v.dot(d) / s);
  if (!(std::abs(u) < kLatticeLimit) || !(std::abs(v) < kLatticeLimit)) return false;
  a = static_cast<std::int32_t>(u);
  b = static_cast<std::int32_t>(v);
  return true;
}

std::uint64_t PlaneLayer::patchKey(std::int32_t tile_a, std::int32_t tile_b) const {
  const auto part = [](std::int32_t tile, std::int32_t anchor) {
    const std::int32_t d = tile - anchor / 8;
    return d >= 0 ? d / kPatchTiles : -((kPatchTiles - 1 - d) / kPatchTiles);
  };
  return packKey(part(tile_a, anchor_a), part(tile_b, anchor_b));
}

void PlaneLayer::markDirty(std::int32_t tile_a, std::int32_t tile_b) {
  PlanePatch& patch = patches[patchKey(tile_a, tile_b)];
  patch.dirty = true;
  patch.include(tile_a, tile_b);
}

void PlaneLayer::setCell(std::int32_t a, std::int32_t b, std::uint8_t belief) {
  RasterTile& tile = tileAt(a >> 3, b >> 3);
  tile.setBelief(static_cast<std::size_t>(8 * (b & 7) + (a & 7)), belief);
  markDirty(a >> 3, b >> 3);
}

std::vector<std::vector<PlacedTile>> PlaneLayer::tilesOf(
    const std::vector<std::size_t>& positions) const {
  std::vector<std::vector<PlacedTile>> all(positions.size());
  std::size_t places = 0;
  for (const std::size_t position : positions) {
    const PlanePatch& patch = patches.value(position);
    if (patch.low_tile_a > patch.high_tile_a) continue;
    places += static_cast<std::size_t>(patch.high_tile_a - patch.low_tile_a + 1) *
              static_cast<std::size_t>(patch.high_tile_b - patch.low_tile_b + 1);
  }
  // To find the patch of a tile takes about four times as long as to find a tile.
  if (4 * tiles.size() <= places) {
    std::vector<std::size_t> place(patches.size(), KeyMap<PlanePatch>::kNone);
    for (std::size_t i = 0; i < positions.size(); ++i) place[positions[i]] = i;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (tiles.value(i).occupied() == 0) continue;
      std::int32_t ta = 0, tb = 0;
      unpackKey(tiles.key(i), ta, tb);
      const std::size_t p = patches.indexOf(patchKey(ta, tb));
      if (p == KeyMap<PlanePatch>::kNone || place[p] == KeyMap<PlanePatch>::kNone) continue;
      all[place[p]].push_back({ta, tb, &tiles.value(i)});
    }
    return all;
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const PlanePatch& patch = patches.value(positions[i]);
    for (std::int32_t tb = patch.low_tile_b; tb <= patch.high_tile_b; ++tb) {
      for (std::int32_t ta = patch.low_tile_a; ta <= patch.high_tile_a; ++ta) {
        const RasterTile* tile = tiles.find(packKey(ta, tb));
        if (tile != nullptr && tile->occupied() != 0) all[i].push_back({ta, tb, tile});
      }
    }
  }
  return all;
}

std::size_t PlaneLayer::tidy(std::uint32_t revision) {
  std::vector<std::size_t> dirty;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    PlanePatch& patch = patches.value(p);
    if (!patch.dirty) continue;
    patch.dirty = false;
    patch.revision = revision;
    dirty.push_back(p);
  }
  if (dirty.empty()) return 0;
  const std::vector<std::vector<PlacedTile>> members = tilesOf(dirty);
  bool any_empty = false;
  for (std::size_t i = 0; i < dirty.size(); ++i) {
    PlanePatch& patch = patches.value(dirty[i]);
    patch.low_tile_a = patch.low_tile_b = kLatticeLimit;
    patch.high_tile_a = patch.high_tile_b = -kLatticeLimit;
    for (const PlacedTile& tile : members[i]) {
      patch.include(tile.a, tile.b);
    }
    any_empty |= members[i].empty();
  }
  if (any_empty) {
    patches.removeIf([](std::uint64_t, const PlanePatch& patch) {
      return patch.low_tile_a > patch.high_tile_a;
    });
    tiles.removeIf([](std::uint64_t, const RasterTile& tile) { return tile.occupied() == 0; });
  }
  low_tile_a_ = low_tile_b_ = kLatticeLimit;
  high_tile_a_ = high_tile_b_ = -kLatticeLimit;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const PlanePatch& patch = patches.value(p);
    low_tile_a_ = std::min(low_tile_a_, patch.low_tile_a);
    low_tile_b_ = std::min(low_tile_b_, patch.low_tile_b);
    high_tile_a_ = std::max(high_tile_a_, patch.high_tile_a);
    high_tile_b_ = std::max(high_tile_b_, patch.high_tile_b);
  }
  return dirty.size();
}

bool PlaneLayer::refit(double s, double tolerance) {
  const PlaneMoments::Fit fit = moments().fit();
  if (!fit.valid) return false;
  const Plane plane = fit.plane.normal.dot(frame().n) < 0.0 ? fit.plane.flipped() : fit.plane;
  std::int32_t low_a = 0, low_b = 0, high_a = 0, high_b = 0;
  if (!extent(low_a, low_b, high_a, high_b)) return false;
  double deviation = 0.0;
  for (const std::int32_t a : {low_a, high_a + 1}) {
    for (const std::int32_t b : {low_b, high_b + 1}) {
      const Vector3 corner = frame().fromPlane({a * s, b * s, 0.0});
      deviation = std::max(deviation, std::abs(plane.signedDistance(corner)));
    }
  }
  if (!(deviation > tolerance)) return false;

  // The new frame keeps the in-plane coordinates of the middle of the points.
  const PlaneFrame before = frame();
  const Vector3 middle = before.toPlane(moments().mean());
  const Vector3 along = before.u - plane.normal.dot(before.u) * plane.normal;
  if (!(along.norm() > 0.5)) return false;  // turned by more than any association allows
  PlaneFrame after;
  after.n = plane.normal;
  after.u = along.normalized();
  after.v = after.n.cross(after.u);
  const Vector3 mean = moments().mean();
  const Vector3 foot = mean - plane.signedDistance(mean) * after.n;
  after.origin = foot - middle.x() * after.u - middle.y() * after.v;
  setFrame(after);
  return true;
}

std::size_t PlaneLayer::memoryBytes() const {
  std::size_t bytes = tiles.memoryBytes() + patches.memoryBytes();
  for (std::size_t i = 0; i < tiles.size(); ++i) bytes += tiles.value(i).memoryBytes();
  return bytes;
}

}  // namespace planar_mapping::detail
