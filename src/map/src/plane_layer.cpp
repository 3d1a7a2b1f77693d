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

/// The tiles of a patch as they are to be approximated: together, or where almost all of their
/// window is empty, each group of tiles that touch on its own. Empty cells cost time too, so that
/// this bounds the time by the number of tiles.
std::vector<std::vector<PlacedTile>> islandsOf(const std::vector<PlacedTile>& tiles) {
  constexpr std::size_t kSparse = 16;  // tiles of the window for each that holds a cell
  if (tiles.empty()) return {};
  PlacedTile low = tiles.front();
  PlacedTile high = tiles.front();
  for (const PlacedTile& t : tiles) {
    low.a = std::min(low.a, t.a);
    low.b = std::min(low.b, t.b);
    high.a = std::max(high.a, t.a);
    high.b = std::max(high.b, t.b);
  }
  const std::int32_t width = high.a - low.a + 1;
  const std::int32_t height = high.b - low.b + 1;
  if (static_cast<std::size_t>(width) * height <= kSparse * tiles.size()) return {tiles};

  std::vector<const RasterTile*> at(static_cast<std::size_t>(width) * height, nullptr);
  const auto place = [&](std::int32_t a, std::int32_t b) -> const RasterTile*& {
    return at[static_cast<std::size_t>(b - low.b) * width + static_cast<std::size_t>(a - low.a)];
  };
  for (const PlacedTile& t : tiles) place(t.a, t.b) = t.tile;
  std::vector<std::vector<PlacedTile>> islands;
  for (std::int32_t b = low.b; b <= high.b; ++b) {
    for (std::int32_t a = low.a; a <= high.a; ++a) {
      if (place(a, b) == nullptr) continue;
      std::vector<PlacedTile> island{{a, b, std::exchange(place(a, b), nullptr)}};
      for (std::size_t i = 0; i < island.size(); ++i) {
        const PlacedTile from = island[i];
        for (std::int32_t nb = std::max(from.b - 1, low.b); nb <= std::min(from.b + 1, high.b);
             ++nb) {
          for (std::int32_t na = std::max(from.a - 1, low.a); na <= std::min(from.a + 1, high.a);
               ++na) {
            if (place(na, nb) == nullptr) continue;
            island.push_back({na, nb, std::exchange(place(na, nb), nullptr)});
          }
        }
      }
      islands.push_back(std::move(island));
    }
  }
  return islands;
}

}  // namespace

PlaneMoments symmetric(const PlaneMoments& moments) {
  const Matrix3 scatter =
      (0.5 * (moments.scatter() + moments.scatter().transpose())).cast<float>().cast<double>();
  return PlaneMoments::fromSums(moments.weight(), Vector3::Zero(), scatter, moments.mean());
}

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

void PlaneLayer::setFrame(const Vector3& origin, const PlaneAxes& u_and_n) {
  axes = u_and_n;
  const Vector3 u(axes[0], axes[1], axes[2]);
  frame.origin = origin;
  frame.n = Vector3(axes[3], axes[4], axes[5]).normalized();
  frame.u = (u - frame.n.dot(u) * frame.n).normalized();
  frame.v = frame.n.cross(frame.u);
  info.plane = {frame.n, -frame.n.dot(frame.origin)};
}

void PlaneLayer::setFrame(const PlaneFrame& wanted) {
  PlaneAxes u_and_n;
  for (int i = 0; i < 3; ++i) {
    u_and_n[static_cast<std::size_t>(i)] = static_cast<float>(wanted.u[i]);
    u_and_n[static_cast<std::size_t>(3 + i)] = static_cast<float>(wanted.n[i]);
  }
  setFrame(wanted.origin, u_and_n);
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
  const Vector3 middle = frame.fromPlane(
      {0.5 * s * (low_a + high_a + 1), 0.5 * s * (low_b + high_b + 1), -0.5 * thickness});
  const Vector3 half = 0.5 * s * (high_a - low_a + 1) * frame.u.cwiseAbs() +
                       0.5 * s * (high_b - low_b + 1) * frame.v.cwiseAbs() +
                       0.5 * thickness * frame.n.cwiseAbs();
  low = middle - half;
  high = middle + half;
  return true;
}

bool PlaneLayer::cellOf(const Vector3& point, double s, std::int32_t& a, std::int32_t& b) const {
  const Vector3 d = point - frame.origin;
  const double u = std::floor(frame.u.dot(d) / s);
  const double v = std::floor(frame.v.dot(d) / s);
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
  patches[patchKey(tile_a, tile_b)].dirty = true;
}

void PlaneLayer::setCell(std::int32_t a, std::int32_t b, std::uint8_t belief) {
  RasterTile& tile = tileAt(a >> 3, b >> 3);
  tile.setBelief(static_cast<std::size_t>(8 * (b & 7) + (a & 7)), belief);
  markDirty(a >> 3, b >> 3);
}

std::vector<PlaneLayer::Members> PlaneLayer::dirtyMembers() const {
  std::vector<Members> all;
  std::vector<std::size_t> place(patches.size(), KeyMap<PlanePatch>::kNone);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    if (!patches.value(p).dirty) continue;
    place[p] = all.size();
    all.push_back({p, {}});
  }
  if (tiles.size() <= all.size() * kPatchTiles * kPatchTiles) {
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (tiles.value(i).occupied() == 0) continue;
      std::int32_t ta = 0, tb = 0;
      unpackKey(tiles.key(i), ta, tb);
      const std::size_t p = patches.indexOf(patchKey(ta, tb));
      if (p == KeyMap<PlanePatch>::kNone || place[p] == KeyMap<PlanePatch>::kNone) continue;
      all[place[p]].tiles.push_back({ta, tb, &tiles.value(i)});
    }
    return all;
  }
  for (Members& members : all) {
    std::int32_t pa = 0, pb = 0;
    unpackKey(patches.key(members.patch), pa, pb);
    const std::int32_t first_a = anchor_a / 8 + pa * kPatchTiles;
    const std::int32_t first_b = anchor_b / 8 + pb * kPatchTiles;
    for (std::int32_t tb = first_b; tb < first_b + kPatchTiles; ++tb) {
      for (std::int32_t ta = first_a; ta < first_a + kPatchTiles; ++ta) {
        const RasterTile* tile = tiles.find(packKey(ta, tb));
        if (tile != nullptr && tile->occupied() != 0) members.tiles.push_back({ta, tb, tile});
      }
    }
  }
  return all;
}

std::vector<Cuboid> PlaneLayer::cuboidsOf(const std::vector<PlacedTile>& members,
                                          const CuboidApproximationParams& params) const {
  // The window is tight to the cells: the paper's first unit is the bounding rectangle.
  std::int32_t low_a = kLatticeLimit, low_b = kLatticeLimit;
  std::int32_t high_a = -kLatticeLimit, high_b = -kLatticeLimit;
  for (const PlacedTile& t : members) {
    for (std::uint64_t bits = t.tile->occupied(); bits != 0; bits &= bits - 1) {
      const int bit = __builtin_ctzll(bits);
      low_a = std::min(low_a, 8 * t.a + (bit & 7));
      high_a = std::max(high_a, 8 * t.a + (bit & 7));
      low_b = std::min(low_b, 8 * t.b + (bit >> 3));
      high_b = std::max(high_b, 8 * t.b + (bit >> 3));
    }
  }
  CellMask mask;
  mask.a0 = low_a;
  mask.b0 = low_b;
  mask.width = high_a - low_a + 1;
  mask.height = high_b - low_b + 1;
  mask.cells.assign(static_cast<std::size_t>(mask.width) * mask.height, 0);
  const bool certain = std::all_of(members.begin(), members.end(), [](const PlacedTile& t) {
    for (std::uint64_t bits = t.tile->occupied(); bits != 0; bits &= bits - 1) {
      if (t.tile->belief(static_cast<std::size_t>(__builtin_ctzll(bits))) != 255) return false;
    }
    return true;
  });
  std::vector<float> probability(certain ? 0 : mask.cells.size(), 1.0f);
  for (const PlacedTile& t : members) {
    for (std::uint64_t bits = t.tile->occupied(); bits != 0; bits &= bits - 1) {
      const int bit = __builtin_ctzll(bits);
      const std::size_t cell = static_cast<std::size_t>(8 * t.b + (bit >> 3) - low_b) * mask.width +
                               static_cast<std::size_t>(8 * t.a + (bit & 7) - low_a);
      mask.cells[cell] = 1;
      if (!certain) probability[cell] = beliefOf(t.tile->belief(static_cast<std::size_t>(bit)));
    }
  }
  return cuboidsOfPlane(frame, mask, probability, info.id, params);
}

std::size_t PlaneLayer::rebuild(const CuboidApproximationParams& params) {
  std::size_t rebuilt = 0;
  bool any_empty = false;
  for (const Members& members : dirtyMembers()) {
    PlanePatch& patch = patches.value(members.patch);
    patch.dirty = false;
    ++rebuilt;
    patch.cuboids.clear();
    any_empty |= members.tiles.empty();
    for (const std::vector<PlacedTile>& part : islandsOf(members.tiles)) {
      const std::vector<Cuboid> some = cuboidsOf(part, params);
      patch.cuboids.insert(patch.cuboids.end(), some.begin(), some.end());
    }
  }
  if (any_empty) {
    patches.removeIf([](std::uint64_t, const PlanePatch& patch) { return patch.cuboids.empty(); });
    tiles.removeIf([](std::uint64_t, const RasterTile& tile) { return tile.occupied() == 0; });
  }
  if (rebuilt > 0) {
    low_tile_a_ = low_tile_b_ = kLatticeLimit;
    high_tile_a_ = high_tile_b_ = -kLatticeLimit;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (tiles.value(i).occupied() == 0) continue;
      std::int32_t ta = 0, tb = 0;
      unpackKey(tiles.key(i), ta, tb);
      low_tile_a_ = std::min(low_tile_a_, ta);
      low_tile_b_ = std::min(low_tile_b_, tb);
      high_tile_a_ = std::max(high_tile_a_, ta);
      high_tile_b_ = std::max(high_tile_b_, tb);
    }
  }
  return rebuilt;
}

bool PlaneLayer::refit(double s, double tolerance) {
  const PlaneMoments::Fit fit = info.moments.fit();
  if (!fit.valid) return false;
  const Plane plane = fit.plane.normal.dot(frame.n) < 0.0 ? fit.plane.flipped() : fit.plane;
  std::int32_t low_a = 0, low_b = 0, high_a = 0, high_b = 0;
  if (!extent(low_a, low_b, high_a, high_b)) return false;
  double deviation = 0.0;
  for (const std::int32_t a : {low_a, high_a + 1}) {
    for (const std::int32_t b : {low_b, high_b + 1}) {
      const Vector3 corner = frame.fromPlane({a * s, b * s, 0.0});
      deviation = std::max(deviation, std::abs(plane.signedDistance(corner)));
    }
  }
  if (!(deviation > tolerance)) return false;

  // The new frame keeps the in-plane coordinates of the middle of the points.
  const PlaneFrame before = frame;
  const Vector3 middle = before.toPlane(info.moments.mean());
  const Vector3 along = before.u - plane.normal.dot(before.u) * plane.normal;
  if (!(along.norm() > 0.5)) return false;  // turned by more than any association allows
  PlaneFrame after;
  after.n = plane.normal;
  after.u = along.normalized();
  setFrame(after);
  const Vector3 mean = info.moments.mean();
  const Vector3 foot = mean - plane.signedDistance(mean) * frame.n;
  frame.origin = foot - middle.x() * frame.u - middle.y() * frame.v;
  info.plane.offset = -frame.n.dot(frame.origin);
  Matrix3 rotation;
  rotation << frame.u, frame.v, frame.n;
  const Quaternion orientation(rotation);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    for (Cuboid& cuboid : patches.value(p).cuboids) {
      // Through whole half cells, so that the result is the one a rebuild would give.
      const Vector3 local = before.toPlane(cuboid.center);
      cuboid.center =
          frame.fromPlane({0.5 * std::round(2.0 * local.x() / s) * s,
                           0.5 * std::round(2.0 * local.y() / s) * s, -0.5 * cuboid.size.z()});
      cuboid.orientation = orientation;
    }
  }
  return true;
}

std::size_t PlaneLayer::memoryBytes() const {
  std::size_t bytes = sizeof(PlaneLayer) + tiles.memoryBytes() + patches.memoryBytes();
  for (std::size_t p = 0; p < patches.size(); ++p) {
    bytes += patches.value(p).cuboids.capacity() * sizeof(Cuboid);
  }
  return bytes;
}

}  // namespace planar_mapping::detail
