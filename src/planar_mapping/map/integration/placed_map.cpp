// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <utility>

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
  const double s = map.resolution();
  placed.cells.anchor = placedAnchor(map, T);
  map.cells.forEachBlock([&](const Int3& at, const CellBlock& block) {
    forEachBit(block.occupied(), [&](std::size_t bit) {
      forEachPartOf(
          map, block, bit, CellLayer::cellOf(at, static_cast<int>(bit)), [&](const Vector3& part) {
            addPart(T * Vector3(s * part), s, block.belief(bit), map.isCompact(), placed.cells);
          });
    });
  });
  placed.commit();
  return placed;
}

}  // namespace planar_mapping::detail
