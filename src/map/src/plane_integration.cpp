// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "belief.h"
#include "frame.h"
#include "lattice.h"

namespace planar_mapping::detail {
namespace {

/// Sensor coordinates to in-plane coordinates in cells: rows u and v.
struct ToCells {
  double m[8];
  ToCells(const MapData& map, const Frame& frame, const PlaneFrame& plane) {
    const double per_cell = 1.0 / map.resolution();
    const Vector3 apart = frame.sensor - plane.origin;
    const Vector3 u = frame.rotation.transpose() * plane.u * per_cell;
    const Vector3 v = frame.rotation.transpose() * plane.v * per_cell;
    for (int i = 0; i < 3; ++i) {
      m[i] = u[i];
      m[4 + i] = v[i];
    }
    m[3] = plane.u.dot(apart) * per_cell;
    m[7] = plane.v.dot(apart) * per_cell;
  }
};

/// Cells that hits of a plane may fall into: those of a new one are as few as its extent needs.
struct Limits {
  std::int32_t low_a = -kLatticeLimit;
  std::int32_t low_b = -kLatticeLimit;
  std::int32_t high_a = kLatticeLimit - 1;
  std::int32_t high_b = kLatticeLimit - 1;
};

/// A side of four metres is forty cells of 0.1 m although it is measured as 4.0000001 m.
constexpr double kRounding = 1e-6;

/// The raster of a new plane starts at the corner of the bounding rectangle of its points, the
/// slack shared by both sides, as in approximateCuboids().
Limits startRaster(const MapData& map, const Frame& frame, PlaneLayer& layer,
                   const std::vector<std::size_t>& segments) {
  const ToCells to_cells(map, frame, layer.frame);
  const PointsView& points = frame.observation->points;
  double extent[4] = {INFINITY, INFINITY, -INFINITY, -INFINITY};
  for (const std::size_t segment : segments) {
    const Indices& inliers = frame.inliersOf(segment);
    planeExtent(points.data, points.stride, inliers.data(), inliers.size(), to_cells.m, extent);
  }
  Limits limits;
  if (!(extent[0] <= extent[2])) return limits;
  double low[2];
  double cells[2];
  for (int axis = 0; axis < 2; ++axis) {
    const double width = extent[2 + axis] - extent[axis];
    cells[axis] = std::max(1.0, std::ceil(width - kRounding));
    low[axis] = extent[axis] - 0.5 * (cells[axis] - width);
  }
  layer.frame.origin =
      layer.frame.fromPlane({low[0] * map.resolution(), low[1] * map.resolution(), 0.0});
  layer.info.plane.offset = -layer.frame.n.dot(layer.frame.origin);
  limits.low_a = limits.low_b = 0;
  limits.high_a = static_cast<std::int32_t>(std::min(cells[0], 1.0 * kLatticeLimit)) - 1;
  limits.high_b = static_cast<std::int32_t>(std::min(cells[1], 1.0 * kLatticeLimit)) - 1;
  // The first patch has what was seen first in its middle.
  layer.anchor_a = 8 * (limits.high_a / 16 - kPatchCells / 16);
  layer.anchor_b = 8 * (limits.high_b / 16 - kPatchCells / 16);
  return limits;
}

/// Counts the points of a segment in the cells of its map plane.
void countHits(const MapData& map, Frame& frame, const PlaneLayer& layer, std::size_t segment,
               const Limits& limits, KeyMap<TileHits>& hits) {
  const ToCells to_cells(map, frame, layer.frame);
  const PointsView& points = frame.observation->points;
  const Indices& inliers = frame.inliersOf(segment);
  const std::vector<float>* belief = frame.observation->probability;

  std::int32_t a[kBatch];
  std::int32_t b[kBatch];
  std::int32_t last_a = kOutside;
  std::int32_t last_b = kOutside;
  TileHits* tile = nullptr;
  for (std::size_t begin = 0; begin < inliers.size(); begin += kBatch) {
    const std::size_t n = std::min(kBatch, inliers.size() - begin);
    planeCells(points.data, points.stride, inliers.data() + begin, n, to_cells.m, a, b);
    for (std::size_t i = 0; i < n; ++i) {
      if (a[i] == kOutside || b[i] == kOutside) {
        ++frame.update.dropped_points;
        continue;
      }
      const std::int32_t ca = std::clamp(a[i], limits.low_a, limits.high_a);
      const std::int32_t cb = std::clamp(b[i], limits.low_b, limits.high_b);
      if ((ca >> 3) != last_a || (cb >> 3) != last_b) {
        last_a = ca >> 3;
        last_b = cb >> 3;
        tile = &hits[packKey(last_a, last_b)];
      }
      const auto bit = static_cast<std::size_t>(8 * (cb & 7) + (ca & 7));
      ++tile->count[bit];
      if (belief != nullptr) {
        tile->belief[bit] += (*belief)[static_cast<std::size_t>(inliers[begin + i])];
      }
    }
  }
}

void applyHits(const MapData& map, Frame& frame, PlaneLayer& layer, const KeyMap<TileHits>& hits) {
  const PlanarMapParams& params = map.params;
  const bool believed = frame.observation->probability != nullptr;
  const auto enough = static_cast<std::uint32_t>(params.approximation.min_points_per_cell);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const TileHits& hit = hits.value(i);
    const std::uint64_t key = hits.key(i);
    std::int32_t tile_a = 0, tile_b = 0;
    unpackKey(key, tile_a, tile_b);
    RasterTile* tile = layer.tiles.find(key);
    bool changed = false;
    for (std::size_t bit = 0; bit < 64; ++bit) {
      const std::uint32_t count = hit.count[bit];
      if (count == 0) continue;
      const double q = believed ? static_cast<double>(hit.belief[bit]) / count : 1.0;
      const std::uint64_t flag = std::uint64_t{1} << bit;
      if (tile != nullptr && (tile->occupied & flag) != 0) {
        const std::uint8_t before = tile->belief[bit];
        const std::uint8_t after = afterHit(before, q, params.belief_gain);
        if (after == before) continue;
        tile->belief[bit] = after;
        changed = true;
        if (!isKept(after, params.min_probability)) {
          tile->occupied &= ~flag;
          tile->belief[bit] = 0;
          ++frame.update.cells_removed;
        }
        continue;
      }
      const std::uint8_t belief = quantiseBelief(q);
      if (count < enough || !isKept(belief, params.min_probability)) {
        frame.update.dropped_points += count;
        continue;
      }
      if (tile == nullptr) tile = &layer.tileAt(tile_a, tile_b);
      tile->occupied |= flag;
      tile->belief[bit] = belief;
      changed = true;
      ++frame.update.cells_added;
    }
    if (changed) layer.markDirty(tile_a, tile_b);
  }
}

}  // namespace

void integratePlanes(MapData& map, Frame& frame) {
  for (PlaneHits& hits : frame.hits) {
    PlaneLayer& layer = map.planes[hits.layer];
    for (const std::size_t segment : hits.segments) {
      layer.info.moments.merge(frame.moments[segment]);
    }
    layer.info.moments = symmetric(layer.info.moments);
    ++layer.info.frames;
    // Cells already there ride along; the new ones enter in the frame as it is from now on.
    if (!hits.is_new) layer.refit(map.resolution(), map.params.refit_tolerance * map.resolution());
    const Limits limits = hits.is_new ? startRaster(map, frame, layer, hits.segments) : Limits();
    for (const std::size_t segment : hits.segments) {
      countHits(map, frame, layer, segment, limits, hits.tiles);
    }
    applyHits(map, frame, layer, hits.tiles);
  }
}

}  // namespace planar_mapping::detail
