// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/integration/map_join.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "planar_mapping/map/integration/frame.h"
#include "planar_mapping/map/integration/placed_cells.h"
#include "planar_mapping/map/store/belief.h"

namespace planar_mapping::detail {
namespace {

/// Tells whether a place is free in a map: measurements passed it and nothing is there.
class FreePlaces {
 public:
  explicit FreePlaces(const MapData& map) : map_(map), cell_(map.unknownResolution()) {
    map.space.forEachRegion([&](const Int3& at, const SpaceRegion& region) {
      SpaceRegion::Blocks blocks;
      region.unpack(blocks);
      std::vector<std::uint64_t>& free = free_[packKey(at)];
      free.resize(SpaceRegion::kBlocks);
      for (std::size_t i = 0; i < free.size(); ++i) free[i] = blocks.cellsOf(i).free;
    });
  }

  bool wasPassed(const Vector3& world) const {
    const Vector3 at = (world / cell_).array().floor();
    if (!(at.cwiseAbs().maxCoeff() < kLatticeLimit)) return false;
    const Int3 c = toInt3(at);
    const std::vector<std::uint64_t>* free =
        free_.find(packKey(Int3{c.x >> 5, c.y >> 5, c.z >> 5}));
    if (free == nullptr) return false;
    const std::int32_t block = (c.x >> 2 & 7) + 8 * (c.y >> 2 & 7) + 64 * (c.z >> 2 & 7);
    return ((*free)[static_cast<std::size_t>(block)] >> UnknownSpace::bitOf(c) & 1u) != 0;
  }
  /// All places from \p low to \p high along three axes (metres, about a centre), a few steps each?
  bool areFree(const Vector3& centre, const Matrix3& axes, const Vector3& low,
               const Vector3& high) const {
    if (!wasPassed(centre)) return false;
    constexpr int kSteps = 2;
    std::vector<Vector3> places;
    const bool were_passed = allPlaces({0, 0, 0}, {kSteps, kSteps, kSteps}, [&](const Int3& step) {
      const Vector3 part = Vector3(step.x, step.y, step.z) / kSteps;
      places.emplace_back(centre + axes * (low + part.cwiseProduct(high - low)));
      return wasPassed(places.back());
    });
    return were_passed && std::none_of(places.begin(), places.end(),
                                       [&](const Vector3& place) { return isMapped(map_, place); });
  }

 private:
  const MapData& map_;
  const double cell_;
  KeyMap<std::vector<std::uint64_t>> free_;  ///< cells of the blocks of each region
};

/// Gives up cells that a later map saw free: as a frame that looks through them, all that it
/// measured there lies behind them by half a cell.
void clearSeenFree(MapData& map, const MapData& later, Frame& frame) {
  const FreePlaces places(later);
  const double s = map.resolution();
  const auto frame_number = static_cast<std::uint32_t>(map.trajectory.size() - 1);
  for (PlaneLayer& layer : map.planes) {
    const PlaneFrame& f = layer.frame();
    Matrix3 axes;
    axes << f.u, f.v, f.n;
    std::vector<std::array<std::int32_t, 3>> gone;  // tile, bit
    layer.raster.forEachTile([&](std::int32_t ta, std::int32_t tb, const RasterTile& tile) {
      forEachBit(tile.occupied(), [&](std::size_t bit) {
        const auto i = static_cast<std::int32_t>(bit);
        const Vector3 centre =
            f.fromPlane({s * (8 * ta + (i & 7) + 0.5), s * (8 * tb + (i >> 3) + 0.5), 0.0});
        if (places.areFree(centre, axes, s * Vector3(-0.5, -0.5, -1.0), s * Vector3(0.5, 0.5, 0.5)))
          gone.push_back({ta, tb, i});
      });
    });
    for (const auto& [ta, tb, bit] : gone) {
      layer.raster.find(ta, tb)->remove(static_cast<std::size_t>(bit));
      layer.raster.markDirty(ta, tb);
    }
    frame.update.cells_removed += gone.size();
  }
  for (CellLayer::Region& region : map.cells.regions.values()) {
    for (std::size_t i = 0; i < region.blocks.size(); ++i) {
      const Int3 at = unpackKey(region.blocks.key(i));
      CellBlock& block = region.blocks.value(i);
      forEachBit(block.occupied(), [&](std::size_t bit) {
        const Int3 c = CellLayer::cellOf(at, static_cast<int>(bit));
        const Vector3 centre = s * (Vector3(c.x, c.y, c.z) + Vector3::Constant(0.5));
        const Vector3 half = Vector3::Constant(s);
        if (!places.areFree(centre, Matrix3::Identity(), -half, half)) return;
        block.remove(bit);
        region.dirty = true;
        region.frame = frame_number;
        ++frame.update.cells_removed;
      });
    }
  }
}

void joinCells(MapData& map, const CellLayer& from, Frame& frame) {
  if (from.empty()) return;
  if (map.cells.empty()) map.cells.anchor = from.anchor;
  const auto frame_number = static_cast<std::uint32_t>(map.trajectory.size() - 1);
  from.forEachBlock([&](const Int3& at, const CellBlock& taken) {
    if (taken.occupied() == 0) return;
    CellBlock& block = map.cells.blockAt(at);
    forEachBit(taken.occupied(), [&](std::size_t bit) {
      const bool known = (block.occupied() >> bit & 1u) != 0;
      const int before = known ? block.octants(bit) : 0;
      const std::uint8_t belief = taken.belief(bit);
      block.setBelief(bit, known ? joinedBelief(block.belief(bit), belief) : belief);
      if (map.isCompact()) {
        block.setOctants(bit, static_cast<std::uint8_t>(before | taken.octants(bit)));
      } else if (!known) {
        block.setMean(bit, taken.mean(bit));
      }
      if (!known) ++frame.update.cells_added;
    });
    map.cells.markDirty(at, frame_number);
  });
}

/// Cells of planes that are none of the map: the middles of the quarters of their cells.
CellLayer looseCells(const MapData& map, const std::vector<PlaneLayer>& loose) {
  CellLayer cells;
  cells.anchor = map.cells.anchor;
  const double s = map.resolution();
  for (const PlaneLayer& layer : loose) {
    layer.raster.forEachTile([&](std::int32_t ta, std::int32_t tb, const RasterTile& tile) {
      forEachBit(tile.occupied(), [&](std::size_t bit) {
        for (int quarter = 0; quarter < 4; ++quarter) {
          const double a = 8.0 * ta + static_cast<double>(bit & 7u) + 0.25 + 0.5 * (quarter & 1);
          const double b = 8.0 * tb + static_cast<double>(bit >> 3u) + 0.25 + 0.5 * (quarter >> 1);
          addPart(layer.frame().fromPlane({a * s, b * s, 0.0}), s, tile.belief(bit),
                  map.isCompact(), cells);
        }
      });
    });
  }
  return cells;
}

}  // namespace

Eigen::AlignedBox3d boundsOf(const MapData& map) {
  Eigen::AlignedBox3d bounds;
  const double s = map.resolution();
  for (const PlaneLayer& layer : map.planes) bounds.extend(layer.bounds(s, map.thickness()));
  map.cells.forEachBlock([&](const Int3& at, const CellBlock&) {
    const Vector3 low = 4.0 * s * Vector3(at.x, at.y, at.z);
    bounds.extend(low).extend(low + Vector3::Constant(4.0 * s));
  });
  return bounds;
}

FrameUpdate joinMap(MapData& map, const MapData& later) {
  Frame frame;
  if (later.trajectory.empty()) return frame.update;
  const bool is_first = map.trajectory.empty();
  const bool is_later =
      !is_first && later.trajectory.front().timestamp > map.trajectory.front().timestamp;
  map.trajectory.insert(map.trajectory.end(), later.trajectory.begin(), later.trajectory.end());
  map.ground.add(later.ground, Pose::Identity(), map.params.approximation.up.normalized());
  if (is_later && later.params.unknown_space) clearSeenFree(map, later, frame);
  const std::vector<PlaneLayer> loose = joinPlanes(map, later.planes, frame);
  mergePlanes(map, frame);
  joinCells(map, later.cells, frame);
  joinCells(map, looseCells(map, loose), frame);
  if (!is_first) absorbCells(map, boundsOf(later), frame);
  if (map.params.unknown_space) map.space.add(later.space);
  frame.update.patches_rebuilt = map.commit();
  return frame.update;
}

}  // namespace planar_mapping::detail
