// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "planar_mapping/map/integration/frame.h"
#include "planar_mapping/map/store/belief.h"
#include "planar_mapping/map/store/lattice.h"

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

/// A side of four metres is forty cells of 0.1 m although it is measured as 4.0000001 m.
constexpr double kRounding = 1e-6;

/// Calls visit(begin, n) for the batches of the inliers of a segment.
template <typename Visit>
void forEachBatch(const Indices& inliers, Visit&& visit) {
  for (std::size_t begin = 0; begin < inliers.size(); begin += kBatch) {
    visit(begin, std::min(kBatch, inliers.size() - begin));
  }
}

/// The raster of a new plane starts at the corner of the bounding rectangle of its points, with as
/// few cells as that needs; what they are larger by is the same on both sides.
CellWindow startRaster(const MapData& map, const Frame& frame, PlaneLayer& layer,
                       std::size_t segment) {
  const ToCells to_cells(map, frame, layer.frame());
  const PointsView& points = frame.observation->points;
  const Indices& inliers = frame.inliersOf(segment);
  Eigen::AlignedBox2d extent;
  double u[kBatch];
  double v[kBatch];
  forEachBatch(inliers, [&](std::size_t begin, std::size_t n) {
    planeCoordinates(points.data, points.stride, inliers.data() + begin, n, to_cells.m, u, v);
    for (std::size_t i = 0; i < n; ++i) {
      if (u[i] != kOutside) extent.extend(Eigen::Vector2d(u[i], v[i]));
    }
  });
  CellWindow window;
  if (extent.isEmpty()) return window;
  const Eigen::Array2d width = extent.sizes();
  const Eigen::Array2d cells = (width - kRounding).ceil().max(1.0);
  const Eigen::Array2d low = extent.min().array() - 0.5 * (cells - width);
  PlaneFrame started = layer.frame();
  started.origin =
      layer.frame().fromPlane({low[0] * map.resolution(), low[1] * map.resolution(), 0.0});
  layer.setFrame(started);
  window.low_a = window.low_b = 0;
  window.high_a = static_cast<std::int32_t>(std::min(cells[0], 1.0 * kLatticeLimit)) - 1;
  window.high_b = static_cast<std::int32_t>(std::min(cells[1], 1.0 * kLatticeLimit)) - 1;
  // The first patch has what was seen first in its middle.
  layer.raster.setAnchor(window.high_a / 16 - kPatchCells / 16,
                         window.high_b / 16 - kPatchCells / 16);
  return window;
}

/// Of points: one each, or the same for all.
struct Beliefs {
  const std::vector<float>* each = nullptr;
  float all = 1.0f;

  /// The sum with those of some points added.
  float addedTo(float sum, const int* first, const int* last) const {
    if (each == nullptr) return sum + all * static_cast<float>(last - first);
    for (; first != last; ++first) sum += (*each)[static_cast<std::size_t>(*first)];
    return sum;
  }
};

/// Counts points of a segment in the cells of its map plane.
void countHits(Frame& frame, const int* indices, const CellRuns& runs, const Beliefs& beliefs,
               KeyMap<TileHits>& hits) {
  std::int32_t last_a = kOutside;
  std::int32_t last_b = kOutside;
  TileHits* tile = nullptr;
  for (std::size_t r = 0; r < runs.size; ++r) {
    const std::uint32_t begin = runs.first[r];
    const std::uint32_t end = runs.first[r + 1];
    const std::int32_t a = runs.a[begin];
    const std::int32_t b = runs.b[begin];
    if (a == kOutside) {
      frame.update.dropped_points += end - begin;
      frame.update.points_beyond += end - begin;
      continue;
    }
    if ((a >> 3) != last_a || (b >> 3) != last_b) {
      last_a = a >> 3;
      last_b = b >> 3;
      tile = &hits[packKey(last_a, last_b)];
    }
    const auto bit = static_cast<std::size_t>(8 * (b & 7) + (a & 7));
    tile->count[bit] += end - begin;
    tile->belief[bit] = beliefs.addedTo(tile->belief[bit], indices + begin, indices + end);
  }
}

/// Counts the points of a segment in the cells of a plane: measured ones in those of the window
/// only, and assumed ones.
void countSegment(const MapData& map, Frame& frame, const PlaneLayer& layer, std::size_t segment,
                  const CellWindow& window, KeyMap<TileHits>& hits) {
  const ToCells to_cells(map, frame, layer.frame());
  double u[kBatch];
  double v[kBatch];
  CellRuns runs;
  const auto count = [&](const float* data, std::size_t stride, const Indices& indices,
                         const Beliefs& beliefs, const CellWindow& within) {
    forEachBatch(indices, [&](std::size_t begin, std::size_t n) {
      planeCoordinates(data, stride, indices.data() + begin, n, to_cells.m, u, v);
      runs.find(u, v, n, within);
      countHits(frame, indices.data() + begin, runs, beliefs, hits);
    });
  };
  const PointsView& points = frame.observation->points;
  count(points.data, points.stride, frame.inliersOf(segment), {frame.observation->probability},
        window);
  const AssumedPoints* assumed = frame.observation->assumed;
  if (assumed == nullptr || segment >= assumed->of_plane.size()) return;
  count(assumed->xyz.data(), 3, assumed->of_plane[segment],
        {nullptr, static_cast<float>(assumed->probability)}, CellWindow());
}

void applyHits(const MapData& map, Frame& frame, PlaneLayer& layer, const PlaneHits& plane_hits) {
  const KeyMap<TileHits>& hits = plane_hits.tiles;
  const PlanarMapParams& params = map.params;
  const auto enough = static_cast<std::uint32_t>(params.approximation.min_points_per_cell);
  // What the first sight of a plane holds is as certain as the plane; what noise adds is not.
  const bool is_sure = plane_hits.is_new || !frame.observation->noise;
  const double most = is_sure ? 1.0 : std::max(params.first_belief, params.min_probability);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const TileHits& hit = hits.value(i);
    const std::uint64_t key = hits.key(i);
    std::int32_t tile_a = 0, tile_b = 0;
    unpackKey(key, tile_a, tile_b);
    RasterTile* tile = layer.raster.find(tile_a, tile_b);
    bool changed = false;
    double min_count = 0.0;  // of a cell that is seen
    if (!plane_hits.is_new) {
      const double s = map.resolution();
      const Vector3 middle =
          layer.frame().fromPlane({(8 * tile_a + 4) * s, (8 * tile_b + 4) * s, 0});
      const double facing = layer.frame().n.dot((frame.sensor - middle).normalized());
      min_count = frame.pointsToBeSeen(params, middle, facing);
    }
    for (std::size_t bit = 0; bit < 64; ++bit) {
      const std::uint32_t count = hit.count[bit];
      if (count == 0) continue;
      const double q = static_cast<double>(hit.belief[bit]) / count;
      const std::uint64_t flag = std::uint64_t{1} << bit;
      if (tile != nullptr && (tile->occupied() & flag) != 0) {
        const std::uint8_t before = tile->belief(bit);
        const std::uint8_t after = afterHit(before, q, params.belief_gain);
        if (after == before) continue;
        changed = true;
        if (isKept(after, params.min_probability)) {
          tile->setBelief(bit, after);
        } else {
          tile->remove(bit);
          ++frame.update.cells_removed;
        }
        continue;
      }
      const std::uint8_t belief = quantiseBelief(std::min(q, most));
      if (count < enough || count < min_count || !isKept(belief, params.min_probability)) {
        frame.update.dropped_points += count;
        continue;
      }
      if (tile == nullptr) tile = &layer.raster.tileAt(tile_a, tile_b);
      tile->setBelief(bit, belief);
      changed = true;
      ++frame.update.cells_added;
    }
    if (changed) layer.raster.markDirty(tile_a, tile_b);
  }
}

}  // namespace

void integratePlanes(MapData& map, Frame& frame) {
  for (PlaneHits& hits : frame.hits) {
    PlaneLayer& layer = map.planes[hits.layer];
    PlaneMoments moments = layer.moments();
    for (const std::size_t segment : hits.segments) moments.merge(frame.moments[segment]);
    layer.setMoments(moments);
    ++layer.frames;
    // Cells already there ride along; the new ones enter in the frame as it is from now on.
    if (!hits.is_new) layer.refit(map.resolution(), map.params.refit_tolerance * map.resolution());
    for (const std::size_t segment : hits.segments) {
      CellWindow window;
      if (hits.is_new) window = startRaster(map, frame, layer, segment);  // it has one segment
      countSegment(map, frame, layer, segment, window, hits.tiles);
    }
    applyHits(map, frame, layer, hits);
  }
}

}  // namespace planar_mapping::detail
