// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/integration/frame.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/number_text.h"
#include "planar_mapping/map/file/map_record.h"
#include "planar_mapping/map/integration/moved_space.h"

namespace planar_mapping::detail {
namespace {

void requireSame(const char* what, double ours, double other) {
  if (ours == other) return;
  throw InputError("maps with different " + std::string(what) +
                   " cannot be merged: " + numberText(ours) + " m here, " + numberText(other) +
                   " m in the other; map one of them again");
}

/// \param T of the other map, a rigid motion
void requireAlike(const MapData& map, const MapData& other, const Pose& T) {
  if (map.isCompact() != other.isCompact()) {
    throw InputError("maps of different profiles cannot be merged; map one of them again");
  }
  requireSame("resolutions", map.resolution(), other.resolution());
  requireSame("resolutions of unknown space", map.unknownResolution(), other.unknownResolution());
  requireSame("thicknesses", map.thickness(), other.thickness());
  constexpr double kMaxTilt = 0.175;  // 10 degrees: poses of maps are not exact
  const Vector3 ours = map.params.approximation.up.normalized();
  const Vector3 theirs = T.linear() * other.params.approximation.up.normalized();
  if (std::acos(std::clamp(ours.dot(theirs), -1.0, 1.0)) <= kMaxTilt) return;
  const auto text = [](const Vector3& up) {
    const Vector3 rounded = (100.0 * up).array().round() / 100.0 + 0.0;  // no -0
    return "(" + numberText(rounded.x()) + ", " + numberText(rounded.y()) + ", " +
           numberText(rounded.z()) + ")";
  };
  throw InputError("up is " + text(ours) + " here, but " + text(theirs) +
                   " in the other map, where its pose puts it; it needs a pose that turns one to "
                   "the other");
}

Int3 cellAt(const Vector3& point, double side) {
  return toInt3((point / side).array().floor());
}

/// Far enough from the end of the lattice for a block around it.
bool isWithin(const Vector3& point, double side) {
  return (point / side).cwiseAbs().maxCoeff() < kLatticeLimit - 8;
}

/// Refuses what the lattice of the map does not hold: nothing is dropped unsaid.
void requireWithin(const MapData& data, const Pose& T, bool with_space) {
  const auto require = [&](const Vector3& low, const Vector3& high, double side) {
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3 at(corner & 1 ? high.x() : low.x(), corner & 2 ? high.y() : low.y(),
                       corner & 4 ? high.z() : low.z());
      if (isWithin(T * at, side)) continue;
      throw InputError("part of it would lie beyond the " + std::to_string(kLatticeLimit) +
                       " cells of " + numberText(side) +
                       " m that a map reaches from its origin along each axis");
    }
  };
  const double s = data.resolution();
  for (const PlaneLayer& layer : data.planes) {
    const Eigen::AlignedBox3d box = layer.bounds(s, data.thickness());
    if (!box.isEmpty()) require(box.min(), box.max(), s);
  }
  const auto requireCube = [&](const Int3& at, double side, double cell) {
    const Vector3 low = side * Vector3(at.x, at.y, at.z);
    require(low, low + Vector3::Constant(side), cell);
  };
  data.cells.forEachBlock([&](const Int3& at, const CellBlock& block) {
    if (block.occupied() != 0) requireCube(at, 4.0 * s, s);
  });
  if (!with_space) return;
  const double cell = data.unknownResolution();
  data.space.forEachRegion(
      [&](const Int3& at, const SpaceRegion&) { requireCube(at, 32.0 * cell, cell); });
}

void takeTrajectory(MapData& map, const MapData& other, const Pose& T) {
  const Quaternion turn(T.linear());
  for (const FramePose& from : other.trajectory) {
    map.trajectory.push_back(
        {from.timestamp, T * from.position, (turn * from.orientation).normalized()});
  }
}

/// Rasters ride along with their planes: no cell is resampled. Those that lie on a plane of the map
/// are joined with it. \return those that are no planes of the map, but cells
std::vector<PlaneLayer> takePlanes(MapData& map, const MapData& other, const Pose& T,
                                   Frame& frame) {
  std::vector<PlaneLayer> placed;
  for (PlaneLayer layer : other.planes) {
    const PlaneMoments moments = layer.moments().transformed(T);
    PlaneFrame axes = layer.frame();
    axes.origin = T * axes.origin;
    axes.u = T.linear() * axes.u;
    axes.n = T.linear() * axes.n;
    layer.setFrame(axes);
    layer.setMoments(moments);
    if (!layer.bounds(map.resolution(), map.thickness()).isEmpty())
      placed.push_back(std::move(layer));
  }
  std::vector<PlaneLayer> loose = joinPlanes(map, std::move(placed), frame);
  mergePlanes(map, frame);
  return loose;
}

/// What one cell of the other map brings to a cell of this one.
struct TakenCell {
  Int3 cell;
  std::uint8_t belief = 0;
  std::uint8_t octants = 0;
  CellBlock::Mean mean{};
};

void takeCell(MapData& map, const TakenCell& taken, Frame& frame) {
  const Int3 at = CellLayer::blockOf(taken.cell);
  const auto bit = static_cast<std::size_t>(CellLayer::bitOf(taken.cell));
  CellBlock& block = map.cells.blockAt(at);
  const bool known = (block.occupied() >> bit & 1u) != 0;
  const std::uint8_t before = known ? block.octants(bit) : 0;
  block.setBelief(bit, known ? std::max(block.belief(bit), taken.belief) : taken.belief);
  if (map.isCompact()) {
    block.setOctants(bit, static_cast<std::uint8_t>(before | taken.octants));
  } else if (!known) {
    block.setMean(bit, taken.mean);
  }
  if (!known) ++frame.update.cells_added;
  map.cells.markDirty(at, static_cast<std::uint32_t>(map.trajectory.size() - 1));
}

/// Takes a place that holds points.
void takePoint(MapData& map, const Vector3& point, std::uint8_t belief, Frame& frame) {
  const double s = map.resolution();
  TakenCell taken;
  taken.cell = cellAt(point, s);
  taken.belief = belief;
  int octant = 0;
  for (int i = 0; i < 3; ++i) {
    const double offset = point[i] / s - std::floor(point[i] / s);
    octant |= offset >= 0.5 ? 1 << i : 0;
    taken.mean[static_cast<std::size_t>(i)] =
        static_cast<std::uint8_t>(std::min(255.0, std::floor(256.0 * offset)));
  }
  taken.octants = static_cast<std::uint8_t>(1 << octant);
  takeCell(map, taken, frame);
}

/// Where the parts of a cell that hold points come to lie: eighths by their middles, else the mean.
void takeParts(MapData& map, const CellBlock& block, const Int3& cell, const Pose& T,
               Frame& frame) {
  const double s = map.resolution();
  const auto bit = static_cast<std::size_t>(CellLayer::bitOf(cell));
  const Vector3 corner(cell.x, cell.y, cell.z);
  const auto take = [&](const Vector3& part) {
    takePoint(map, T * Vector3(s * (corner + part)), block.belief(bit), frame);
  };
  if (!map.isCompact()) {
    const CellBlock::Mean mean = block.mean(bit);
    return take((Vector3(mean[0], mean[1], mean[2]) + Vector3::Constant(0.5)) / 256.0);
  }
  forEachBit(block.octants(bit), [&](std::size_t i) {
    take({0.25 + 0.5 * (i & 1u), 0.25 + 0.5 * (i >> 1u & 1u), 0.25 + 0.5 * (i >> 2u)});
  });
}

void takeCells(MapData& map, const MapData& other, const Pose& T, Frame& frame) {
  if (other.cells.empty()) return;
  const double s = map.resolution();
  if (map.cells.empty()) {
    const Int3& a = other.cells.anchor;
    const Vector3 middle = Vector3(a.x, a.y, a.z) + Vector3::Constant(kRegionCells / 2);
    const Vector3 placed = T * Vector3(s * middle) / s;
    const auto part = [](double coordinate) {
      return 4 * static_cast<std::int32_t>(std::floor((coordinate + 0.5) / 4.0)) - kRegionCells / 2;
    };
    map.cells.anchor = {part(placed.x()), part(placed.y()), part(placed.z())};
  }
  other.cells.forEachBlock([&](const Int3& at, const CellBlock& block) {
    for (std::uint64_t bits = block.occupied(); bits != 0; bits &= bits - 1) {
      takeParts(map, block, CellLayer::cellOf(at, __builtin_ctzll(bits)), T, frame);
    }
  });
}

/// Cells of a plane that is none of the map: the middles of the quarters of its cells.
void takeLoose(MapData& map, const PlaneLayer& layer, Frame& frame) {
  const double s = map.resolution();
  layer.raster.forEachTile([&](std::int32_t ta, std::int32_t tb, const RasterTile& tile) {
    forEachBit(tile.occupied(), [&](std::size_t bit) {
      for (int quarter = 0; quarter < 4; ++quarter) {
        const double a = 8.0 * ta + static_cast<double>(bit & 7u) + 0.25 + 0.5 * (quarter & 1);
        const double b = 8.0 * tb + static_cast<double>(bit >> 3u) + 0.25 + 0.5 * (quarter >> 1);
        takePoint(map, layer.frame().fromPlane({a * s, b * s, 0.0}), tile.belief(bit), frame);
      }
    });
  });
}

/// Where the planes and cells of a map lie, placed by a pose.
Eigen::AlignedBox3d placedBounds(const MapData& map, const Pose& T) {
  Eigen::AlignedBox3d bounds;
  const auto include = [&](const Eigen::AlignedBox3d& box) {
    for (int corner = 0; corner < 8 && !box.isEmpty(); ++corner)
      bounds.extend(T * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  };
  const double s = map.resolution();
  for (const PlaneLayer& layer : map.planes) include(layer.bounds(s, map.thickness()));
  map.cells.forEachBlock([&](const Int3& at, const CellBlock&) {
    const Vector3 low = 4.0 * s * Vector3(at.x, at.y, at.z);
    include({low, low + Vector3::Constant(4.0 * s)});
  });
  return bounds;
}

FrameUpdate take(MapData& map, const MapData& other, const Pose& T) {
  Frame frame;
  if (other.trajectory.empty()) return frame.update;
  const bool is_first = map.trajectory.empty();
  std::optional<UnknownSpace> moved;  // first: it may be refused
  if (map.params.unknown_space && T.matrix() != Pose::Identity().matrix())
    moved = movedSpace(other.space, map.unknownResolution(), T);
  takeTrajectory(map, other, T);
  map.ground.add(other.ground, T, map.params.approximation.up.normalized());
  const std::vector<PlaneLayer> loose = takePlanes(map, other, T, frame);
  takeCells(map, other, T, frame);
  for (const PlaneLayer& layer : loose) takeLoose(map, layer, frame);
  if (!is_first) absorbCells(map, placedBounds(other, T), frame);
  if (map.params.unknown_space) map.space.add(moved ? *moved : other.space);
  frame.update.patches_rebuilt = map.commit();
  return frame.update;
}

/// All that is known of space, whatever the numbers of planes.
std::vector<std::uint8_t> contentOf(const MapData& map) {
  MapRecord record = recordOf(map, {});
  record.params = PlanarMapParams();
  record.params.approximation = map.params.approximation;
  record.next_plane_id = 0;
  for (PlaneRecord& plane : record.planes) plane.id = record.next_plane_id++;
  return sectionsOf(std::move(record));
}

/// Of two maps with frames: negative if \p a began first, 0 if they are the same.
int compare(const MapData& a, const MapData& b) {
  const double begins = a.trajectory.front().timestamp - b.trajectory.front().timestamp;
  if (begins != 0.0) return begins < 0.0 ? -1 : 1;
  const std::vector<std::uint8_t> content_a = contentOf(a), content_b = contentOf(b);
  return content_a < content_b ? -1 : content_b < content_a ? 1 : 0;
}

}  // namespace

FrameUpdate mergeMaps(MapData& map, const MapData& other, const Pose& T_map_other) {
  Pose T = T_map_other;
  requirePose(T);
  T.linear() = Quaternion(T.linear()).normalized().toRotationMatrix();
  requireAlike(map, other, T);
  const bool in_place = T.matrix() == Pose::Identity().matrix();
  if (other.trajectory.empty()) return {};
  const int order = map.trajectory.empty() ? 1 : compare(map, other);
  if (order == 0 && in_place) return {};
  requireWithin(other, T, map.params.unknown_space);
  if (order <= 0) return take(map, other, T);
  // The one that began first takes the other, whichever was asked to.
  MapData first(map.params);
  if (in_place && other.params.unseen == map.params.unseen &&
      other.params.unknown_space == map.params.unknown_space) {
    first = other;
    first.params = map.params;
  } else {
    take(first, other, T);
  }
  FrameUpdate update = take(first, map, Pose::Identity());
  update.planes_new = first.planes.size() + update.planes_merged - map.planes.size();
  map = std::move(first);
  return update;
}

}  // namespace planar_mapping::detail
