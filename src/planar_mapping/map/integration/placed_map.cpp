// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "planar_mapping/map/integration/map_join.h"
#include "planar_mapping/map/integration/moved_space.h"
#include "planar_mapping/map/integration/placed_cells.h"

namespace planar_mapping::detail {
namespace {

Int3 placedAnchor(const MapData& map, const Pose& T) {
  const Int3& a = map.cells.anchor;
  const double s = map.resolution();
  const Vector3 middle = Vector3(a.x, a.y, a.z) + Vector3::Constant(kRegionCells / 2);
  const Vector3 placed = T * Vector3(s * middle) / s;
  const auto part = [](double coordinate) {
    return 4 * static_cast<std::int32_t>(std::floor((coordinate + 0.5) / 4.0)) - kRegionCells / 2;
  };
  return {part(placed.x()), part(placed.y()), part(placed.z())};
}

/// Puts cells elsewhere so that there are about as many as before: a moved cell becomes the cells
/// whose centres it holds; one that holds none becomes the cell that its own centre lies in, if
/// that is none yet. Others that hold points are added only where they close a gap.
class CellMover {
 public:
  CellMover(const MapData& map, const Pose& T, CellLayer& placed)
      : map_(map),
        s_(map.resolution()),
        T_(T),
        reach_(0.5 * T.linear().cwiseAbs().rowwise().sum()),
        placed_(placed) {}

  void run() {
    moveCells();
    std::vector<const MovedCell*> without;  // a centre
    for (const MovedCell& cell : moved_) {
      if (!placeByCentres(cell)) without.push_back(&cell);
    }
    for (const MovedCell* cell : without) {
      if (!isPlaced(cellAt(cell->middle))) add(cell->middle, cell->belief);
    }
    closeGaps();
    // Points lie where they lay, or at the nearest place within a cell there is.
    for (const MovedCell& cell : moved_)
      for (std::size_t i = cell.first_part; i < cell.end_part; ++i)
        placeNearest(parts_[i], cell.belief);
  }

 private:
  /// A cell where it is moved, in cells.
  struct MovedCell {
    Vector3 middle;
    std::size_t first_part, end_part;
    std::uint8_t belief;
  };
  void moveCells() {
    map_.cells.forEachBlock([&](const Int3& at, const CellBlock& block) {
      forEachBit(block.occupied(), [&](std::size_t bit) {
        const std::size_t first = parts_.size();
        const Int3 cell = CellLayer::cellOf(at, static_cast<int>(bit));
        forEachPartOf(map_, block, bit, cell, [&](const Vector3& part) {
          parts_.emplace_back(T_ * Vector3(s_ * part) / s_);
        });
        moved_.push_back(
            {T_ * Vector3(s_ * centreOf(cell)) / s_, first, parts_.size(), block.belief(bit)});
      });
    });
  }
  static Int3 cellAt(const Vector3& place) { return toInt3(place.array().floor()); }
  static Vector3 centreOf(const Int3& cell) {
    return Vector3(cell.x, cell.y, cell.z) + Vector3::Constant(0.5);
  }
  /// The nearest place that is in the cell whatever is rounded.
  static Vector3 within(const Int3& cell, const Vector3& place) {
    constexpr double kInside = 0.499;
    const Vector3 offset = place - centreOf(cell);
    return centreOf(cell) +
           offset.cwiseMax(Vector3::Constant(-kInside)).cwiseMin(Vector3::Constant(kInside));
  }
  bool isPlaced(const Int3& cell) const {
    const CellBlock* block = placed_.find(CellLayer::blockOf(cell));
    return block != nullptr && (block->occupied() >> CellLayer::bitOf(cell) & 1u) != 0;
  }
  void add(const Vector3& place, std::uint8_t belief) {
    addPart(s_ * place, s_, belief, map_.isCompact(), placed_);
  }
  bool placeByCentres(const MovedCell& moved) {
    bool is_placed = false;
    const Vector3 low = moved.middle - reach_, high = moved.middle + reach_;
    forEachPlace(cellAt(low), cellAt(high), [&](const Int3& cell) {
      const Vector3 centre = centreOf(cell);
      const Vector3 offset = T_.linear().transpose() * (centre - moved.middle);
      if (!((offset.array() >= -0.5).all() && (offset.array() < 0.5).all())) return;
      const auto nearest =
          std::min_element(parts_.begin() + static_cast<std::ptrdiff_t>(moved.first_part),
                           parts_.begin() + static_cast<std::ptrdiff_t>(moved.end_part),
                           [&](const Vector3& a, const Vector3& b) {
                             return (a - centre).squaredNorm() < (b - centre).squaredNorm();
                           });
      add(within(cell, *nearest), moved.belief);
      is_placed = true;
    });
    return is_placed;
  }
  /// Adds cells that hold points where the space on two sides of them would be one without them.
  void closeGaps() {
    std::vector<Int3> added;
    for (const MovedCell& cell : moved_) {
      for (std::size_t i = cell.first_part; i < cell.end_part; ++i) {
        if (isPlaced(cellAt(parts_[i]))) continue;
        added.push_back(cellAt(parts_[i]));
        add(parts_[i], cell.belief);
      }
    }
    for (const Int3& cell : added) {
      if (!separates(cell))
        placed_.find(CellLayer::blockOf(cell))
            ->remove(static_cast<std::size_t>(CellLayer::bitOf(cell)));
    }
  }
  /// Is there empty space beside a cell that no way about it leads to from the rest of it?
  bool separates(const Int3& cell) const {
    std::array<bool, 27> open{};  // 9 z + 3 y + x
    for (int i = 0; i < 27; ++i)
      open[static_cast<std::size_t>(i)] =
          i != 13 && !isPlaced({cell.x + i % 3 - 1, cell.y + i / 3 % 3 - 1, cell.z + i / 9 - 1});
    constexpr std::array<int, 6> kFaces = {4, 10, 12, 14, 16, 22};
    const auto first = std::find_if(kFaces.begin(), kFaces.end(),
                                    [&](int face) { return open[static_cast<std::size_t>(face)]; });
    if (first == kFaces.end()) return true;
    std::vector<int> reached = {*first};
    open[static_cast<std::size_t>(*first)] = false;
    for (std::size_t next = 0; next < reached.size(); ++next) {
      const int at = reached[next];
      for (const int step : {1, 3, 9}) {
        for (const int to : {at - step, at + step}) {
          const bool is_beside = to >= 0 && to < 27 && at / (3 * step) == to / (3 * step);
          if (!is_beside || !open[static_cast<std::size_t>(to)]) continue;
          open[static_cast<std::size_t>(to)] = false;
          reached.push_back(to);
        }
      }
    }
    return std::any_of(kFaces.begin(), kFaces.end(),
                       [&](int face) { return open[static_cast<std::size_t>(face)]; });
  }
  void placeNearest(const Vector3& part, std::uint8_t belief) {
    const Int3 own = cellAt(part);
    Vector3 best = part;
    double least = isPlaced(own) ? 0.0 : std::numeric_limits<double>::infinity();
    if (least > 0.0) {
      forEachPlace({own.x - 1, own.y - 1, own.z - 1}, {own.x + 1, own.y + 1, own.z + 1},
                   [&](const Int3& cell) {
                     const Vector3 place = within(cell, part);
                     const double distance = (place - part).squaredNorm();
                     if (distance >= least || !isPlaced(cell)) return;
                     least = distance;
                     best = place;
                   });
    }
    add(best, belief);
  }

  const MapData& map_;
  const double s_;
  const Pose& T_;
  const Vector3 reach_;  ///< half of the bounds of a moved cell, cells
  CellLayer& placed_;
  std::vector<MovedCell> moved_;
  std::vector<Vector3> parts_;  ///< of all of them, cells
};

}  // namespace

void addPart(const Vector3& point, double s, std::uint8_t belief, bool is_compact,
             CellLayer& cells) {
  const Int3 cell = toInt3((point / s).array().floor());
  CellBlock::Mean mean{};
  int octant = 0;
  for (int i = 0; i < 3; ++i) {
    const double offset = point[i] / s - std::floor(point[i] / s);
    octant |= offset >= 0.5 ? 1 << i : 0;
    mean[static_cast<std::size_t>(i)] =
        static_cast<std::uint8_t>(std::min(255.0, std::floor(256.0 * offset)));
  }
  const auto bit = static_cast<std::size_t>(CellLayer::bitOf(cell));
  CellBlock& block = cells.blockAt(CellLayer::blockOf(cell));
  const bool known = (block.occupied() >> bit & 1u) != 0;
  const int before = known ? block.octants(bit) : 0;
  block.setBelief(bit, known ? std::max(block.belief(bit), belief) : belief);
  if (is_compact) {
    block.setOctants(bit, static_cast<std::uint8_t>(before | 1 << octant));
  } else if (!known) {
    block.setMean(bit, mean);
  }
}

MapData placedMap(const MapData& map, const Pose& T) {
  MapData placed(map.params);
  const Vector3 up = T.linear() * map.params.approximation.up.normalized();
  placed.params.approximation.up = up;
  if (map.params.unknown_space) placed.space = movedSpace(map.space, map.unknownResolution(), T);
  const Quaternion turn(T.linear());
  for (const FramePose& from : map.trajectory) {
    placed.trajectory.push_back(
        {from.timestamp, T * from.position, (turn * from.orientation).normalized()});
  }
  placed.ground.add(map.ground, T, up);
  for (PlaneLayer layer : map.planes) {
    const PlaneMoments moments = layer.moments().transformed(T);
    PlaneFrame axes = layer.frame();
    axes.origin = T * axes.origin;
    axes.u = T.linear() * axes.u;
    axes.n = T.linear() * axes.n;
    layer.setFrame(axes);
    layer.setMoments(moments);
    placed.planes.push_back(std::move(layer));
  }
  placed.next_plane_id = map.next_plane_id;
  placed.cells.anchor = placedAnchor(map, T);
  CellMover(map, T, placed.cells).run();
  placed.commit();
  return placed;
}

}  // namespace planar_mapping::detail
