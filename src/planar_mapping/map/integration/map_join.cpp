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

/// The middle of a quarter of a cell of a plane, metres.
Vector3 quarterOf(const PlaneFrame& plane, double s, std::int32_t a, std::int32_t b, int quarter) {
  return plane.fromPlane(
      {s * (a + 0.25 + 0.5 * (quarter & 1)), s * (b + 0.25 + 0.5 * (quarter >> 1)), 0.0});
}

/// What a later map says of parts of the cells of an earlier one.
class LaterPlaces {
 public:
  explicit LaterPlaces(const MapData& later)
      : later_(later), s_(later.resolution()), cell_(later.unknownResolution()) {
    for (const PlaneLayer& layer : later.planes)
      bounds_.push_back(layer.bounds(s_, later.thickness()));
    later.space.forEachRegion([&](const Int3& at, const SpaceRegion&) {
      const Vector3 low = 32.0 * cell_ * Vector3(at.x, at.y, at.z);
      reach_.extend(low).extend(low + Vector3::Constant(32.0 * cell_));
    });
  }

  /// Looks at planes about a box (metres) alone, until it is called again.
  /// \return whether the later map knows anything of space there
  bool lookAt(const Eigen::AlignedBox3d& box) {
    const Vector3 margin = Vector3::Constant(2.0 * s_);
    const Eigen::AlignedBox3d wide(box.min() - margin, box.max() + margin);
    near_.clear();
    if (!reach_.intersects(wide)) return false;
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
      if (bounds_[i].intersects(wide)) near_.push_back(&later_.planes[i]);
    }
    return true;
  }
  /// Is a cell gone? The later map must have looked through all within half a cell of each part,
  /// or up to a surface of its own; what lies within half a cell of a plane that crosses the cell
  /// tells nothing, but not all parts may.
  /// \param parts  their middles, metres
  /// \param axes   of a planar one the last is the normal: it must have looked through a cell
  ///               behind it
  bool isGone(const std::vector<Vector3>& parts, const Matrix3& axes, bool is_planar) const {
    const double back = is_planar ? s_ : 0.5 * s_;
    bool is_gone = false;
    for (const Vector3& part : parts) {
      if (is_planar && isNearPlane(part, 0.5 * s_, axes.col(2))) return false;
      if (isNearPlane(part, 0.5 * s_)) continue;
      if (!wasLookedThrough(part)) return false;
      for (std::size_t i = 0; i < 12; ++i) {
        const double n = i < 4 ? -back : i < 8 ? 0.5 * (0.5 * s_ - back) : 0.5 * s_;
        const Vector3 place = part + axes * Vector3((i & 1u) != 0 ? 0.5 * s_ : -0.5 * s_,
                                                    (i & 2u) != 0 ? 0.5 * s_ : -0.5 * s_, n);
        if (!wasLookedThrough(place) || isInCell(place)) return false;
      }
      is_gone = true;
    }
    return is_gone;
  }

 private:
  bool wasPassed(const Vector3& world) const {
    const Vector3 at = (world / cell_).array().floor();
    if (!(at.cwiseAbs().maxCoeff() < kLatticeLimit)) return false;
    const Int3 c = toInt3(at);
    const std::vector<std::uint64_t>& free = freeOf({c.x >> 5, c.y >> 5, c.z >> 5});
    if (free.empty()) return false;
    const std::int32_t block = (c.x >> 2 & 7) + 8 * (c.y >> 2 & 7) + 64 * (c.z >> 2 & 7);
    return (free[static_cast<std::size_t>(block)] >> UnknownSpace::bitOf(c) & 1u) != 0;
  }
  /// Cells of the blocks of a region, which is unpacked the first time; none where there is no such
  /// region.
  const std::vector<std::uint64_t>& freeOf(const Int3& at) const {
    const std::uint64_t key = packKey(at);
    if (last_free_ != nullptr && key == last_key_) return *last_free_;
    last_key_ = key;
    last_free_ = free_.find(key);
    if (last_free_ != nullptr) return *last_free_;
    std::vector<std::uint64_t>& free = free_[key];
    last_free_ = &free;
    if (const SpaceRegion* region = later_.space.region(at)) {
      SpaceRegion::Blocks blocks;
      region->unpack(blocks);
      free.resize(SpaceRegion::kBlocks);
      for (std::size_t i = 0; i < free.size(); ++i) free[i] = blocks.cellsOf(i).free;
    }
    return free;
  }
  bool isInCell(const Vector3& world) const {
    const Vector3 at = (world / s_).array().floor();
    if (!(at.cwiseAbs().maxCoeff() < kLatticeLimit)) return false;
    const Int3 cell = toInt3(at);
    const CellBlock* block = later_.cells.find(CellLayer::blockOf(cell));
    return block != nullptr && (block->occupied() >> CellLayer::bitOf(cell) & 1u) != 0;
  }
  /// \param normal  of planes that are looked at; 0 = all are
  bool isNearPlane(const Vector3& world, double distance,
                   const Vector3& normal = Vector3::Zero()) const {
    constexpr double kAlike = 0.7071;  // cosine of 45 degrees
    return std::any_of(near_.begin(), near_.end(), [&](const PlaneLayer* layer) {
      std::int32_t a = 0, b = 0;
      return std::abs(layer->plane().signedDistance(world)) <= distance &&
             layer->cellOf(world, s_, a, b) && layer->raster.at(a, b) &&
             (normal.isZero() || layer->plane().normal.dot(normal) > kAlike);
    });
  }
  bool wasLookedThrough(const Vector3& world) const {
    return wasPassed(world) || isNearPlane(world, s_);
  }

  const MapData& later_;
  const double s_;
  const double cell_;
  mutable KeyMap<std::vector<std::uint64_t>> free_;  ///< of freeOf()
  mutable std::uint64_t last_key_ = 0;
  mutable const std::vector<std::uint64_t>* last_free_ = nullptr;  ///< of last_key_
  std::vector<Eigen::AlignedBox3d> bounds_;                        ///< of its planes
  Eigen::AlignedBox3d reach_;                                      ///< of its space
  std::vector<const PlaneLayer*> near_;
};

/// Gives up cells that a later map saw free.
void clearSeenFree(MapData& map, const MapData& later, Frame& frame) {
  LaterPlaces places(later);
  const double s = map.resolution();
  const auto frame_number = static_cast<std::uint32_t>(map.trajectory.size() - 1);
  std::vector<Vector3> parts;
  for (PlaneLayer& layer : map.planes) {
    const PlaneFrame& f = layer.frame();
    Matrix3 axes;
    axes << f.u, f.v, f.n;
    std::vector<std::array<std::int32_t, 3>> gone;  // tile, bit
    layer.raster.forEachTile([&](std::int32_t ta, std::int32_t tb, const RasterTile& tile) {
      Eigen::AlignedBox3d box;
      for (int corner = 0; corner < 4; ++corner)
        box.extend(
            f.fromPlane({8.0 * s * (ta + (corner & 1)), 8.0 * s * (tb + (corner >> 1)), 0.0}));
      if (!places.lookAt(box)) return;
      forEachBit(tile.occupied(), [&](std::size_t bit) {
        const auto i = static_cast<std::int32_t>(bit);
        parts.clear();
        for (int quarter = 0; quarter < 4; ++quarter)
          parts.push_back(quarterOf(f, s, 8 * ta + (i & 7), 8 * tb + (i >> 3), quarter));
        if (places.isGone(parts, axes, true)) gone.push_back({ta, tb, i});
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
      const Vector3 low = 4.0 * s * Vector3(at.x, at.y, at.z);
      if (!places.lookAt({low, low + Vector3::Constant(4.0 * s)})) continue;
      forEachBit(block.occupied(), [&](std::size_t bit) {
        parts.clear();
        forEachPartOf(map, block, bit, CellLayer::cellOf(at, static_cast<int>(bit)),
                      [&](const Vector3& part) { parts.push_back(s * part); });
        if (!places.isGone(parts, Matrix3::Identity(), false)) return;
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
        const auto i = static_cast<std::int32_t>(bit);
        for (int quarter = 0; quarter < 4; ++quarter)
          addPart(quarterOf(layer.frame(), s, 8 * ta + (i & 7), 8 * tb + (i >> 3), quarter), s,
                  tile.belief(bit), map.isCompact(), cells);
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

FrameUpdate joinMap(MapData& map, const MapData& later, Order order) {
  Frame frame;
  if (later.trajectory.empty()) return frame.update;
  const bool is_first = map.trajectory.empty();
  map.trajectory.insert(map.trajectory.end(), later.trajectory.begin(), later.trajectory.end());
  map.ground.add(later.ground, Pose::Identity(), map.params.approximation.up.normalized());
  if (order == Order::Later && !is_first && later.params.unknown_space)
    clearSeenFree(map, later, frame);
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
