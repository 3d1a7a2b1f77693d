// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/map/integration/frame.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/number_text.h"
#include "planar_mapping/map/file/map_record.h"

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

/// A motion by whole blocks of space: the coordinates in blocks that it adds.
std::optional<Int3> wholeBlocks(const MapData& map, const Pose& T) {
  const Vector3 blocks = T.translation() / (4.0 * map.unknownResolution());
  if (!T.linear().isIdentity(0.0) || !(blocks.array() == blocks.array().round()).all() ||
      !(blocks.cwiseAbs().maxCoeff() < kLatticeLimit)) {
    return std::nullopt;
  }
  return toInt3(blocks.array());
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
  // Regions of 32 x 32 x 32 cells that are resampled cell by cell: some 2 GB.
  constexpr std::size_t kMaxResampled = std::size_t{1} << 14;
  std::size_t regions = 0;
  data.space.forEachRegion([&](const Int3& at) {
    requireCube(at, 32.0 * cell, cell);
    ++regions;
  });
  if (regions <= kMaxResampled || wholeBlocks(data, T)) return;
  throw InputError("its pose turns the map, or moves it by no multiple of " +
                   numberText(4.0 * cell) +
                   " m, so that space is resampled: " + std::to_string(regions) + " cubes of " +
                   numberText(32.0 * cell) + " m, more than " + std::to_string(kMaxResampled));
}

void takeTrajectory(MapData& map, const MapData& other, const Pose& T) {
  const Quaternion turn(T.linear());
  for (const FramePose& from : other.trajectory) {
    map.trajectory.push_back(
        {from.timestamp, T * from.position, (turn * from.orientation).normalized()});
  }
}

/// Rasters ride along with their planes: no cell is resampled. Those that lie on a plane of the map
/// are joined with it.
void takePlanes(MapData& map, const MapData& other, const Pose& T, Frame& frame) {
  for (PlaneLayer layer : other.planes) {
    const PlaneMoments moments = layer.moments().transformed(T);
    PlaneFrame placed = layer.frame();
    placed.origin = T * placed.origin;
    placed.u = T.linear() * placed.u;
    placed.n = T.linear() * placed.n;
    layer.setFrame(placed);
    layer.setMoments(moments);
    if (layer.bounds(map.resolution(), map.thickness()).isEmpty()) continue;
    layer.id = map.next_plane_id++;
    layer.raster.markAllDirty();
    frame.hits.push_back({map.planes.size(), true, {}, {}});
    map.planes.push_back(std::move(layer));
    ++frame.update.planes_new;
  }
  mergePlanes(map, frame);
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

/// Where the parts of a cell that hold points come to lie: eighths by their middles, else the mean.
void takeParts(MapData& map, const CellBlock& block, const Int3& cell, const Pose& T,
               Frame& frame) {
  const double s = map.resolution();
  const auto bit = static_cast<std::size_t>(CellLayer::bitOf(cell));
  const Vector3 corner(cell.x, cell.y, cell.z);
  const auto take = [&](const Vector3& part) {
    const Vector3 point = T * Vector3(s * (corner + part));
    TakenCell taken;
    taken.cell = cellAt(point, s);
    taken.belief = block.belief(bit);
    int octant = 0;
    for (int i = 0; i < 3; ++i) {
      const double offset = point[i] / s - std::floor(point[i] / s);
      octant |= offset >= 0.5 ? 1 << i : 0;
      taken.mean[static_cast<std::size_t>(i)] =
          static_cast<std::uint8_t>(std::min(255.0, std::floor(256.0 * offset)));
    }
    taken.octants = static_cast<std::uint8_t>(1 << octant);
    takeCell(map, taken, frame);
  };
  if (!map.isCompact()) {
    const CellBlock::Mean mean = block.mean(bit);
    return take((Vector3(mean[0], mean[1], mean[2]) + Vector3::Constant(0.5)) / 256.0);
  }
  for (int i = 0; i < 8; ++i) {
    if ((block.octants(bit) >> i & 1) == 0) continue;
    take({0.25 + 0.5 * (i & 1), 0.25 + 0.5 * (i >> 1 & 1), 0.25 + 0.5 * (i >> 2)});
  }
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

/// A block of this map as the other knows it: cells by their middles.
SpaceBlock blockFrom(const KeyMap<SpaceBlock>& known, const Int3& at, double s, const Pose& back) {
  SpaceBlock block;
  for (int bit = 0; bit < 64; ++bit) {
    const Int3 cell = CellLayer::cellOf(at, bit);
    const Vector3 middle(cell.x + 0.5, cell.y + 0.5, cell.z + 0.5);
    const Int3 from = cellAt(back * Vector3(s * middle), s);
    const SpaceBlock* found = known.find(packKey(CellLayer::blockOf(from)));
    if (found == nullptr) continue;
    const int place = CellLayer::bitOf(from);
    block.free |= (found->free >> place & 1u) << bit;
    block.unknown |= (found->unknown >> place & 1u) << bit;
  }
  return block;
}

void sortByRegion(std::vector<UnknownSpace::PlacedBlock>& blocks) {
  const auto order = [](const UnknownSpace::PlacedBlock& block) {
    const Int3& b = block.at;
    return std::make_tuple(b.x >> 3, b.y >> 3, b.z >> 3, b.x, b.y, b.z);
  };
  std::sort(blocks.begin(), blocks.end(),
            [&](const auto& a, const auto& b) { return order(a) < order(b); });
}

void takeSpace(MapData& map, const MapData& other, const Pose& T) {
  const double s = map.unknownResolution();
  if (const std::optional<Int3> by = wholeBlocks(map, T)) {
    std::vector<UnknownSpace::PlacedBlock> blocks;  // as many as a region has
    const auto add = [&]() {
      sortByRegion(blocks);
      map.space.add(blocks);
      blocks.clear();
    };
    other.space.forEachBlock([&](const Int3& at, const SpaceBlock& block) {
      if ((block.free | block.unknown) != 0) {
        blocks.push_back({{at.x + by->x, at.y + by->y, at.z + by->z}, block});
      }
      if (blocks.size() == SpaceRegion::kBlocks) add();
    });
    return add();
  }
  KeyMap<SpaceBlock> known;
  other.space.forEachBlock([&](const Int3& at, const SpaceBlock& block) {
    if ((block.free | block.unknown) != 0) known[packKey(at)] = block;
  });
  // Every block of this map that one of the other may reach, once.
  const double reach = 0.5 * 4.0 * s * T.linear().cwiseAbs().rowwise().sum().maxCoeff();
  KeyMap<std::uint8_t> reached;
  for (const std::uint64_t key : known.keys()) {
    const Int3 at = unpackKey(key);
    const Vector3 middle = T * Vector3(4.0 * s * Vector3(at.x + 0.5, at.y + 0.5, at.z + 0.5));
    // Blocks that only touch have no cell in common.
    const Vector3 half = Vector3::Constant(reach - 0.01 * s);
    forEachPlace(cellAt(middle - half, 4.0 * s), cellAt(middle + half, 4.0 * s),
                 [&](const Int3& block) { reached.insert(packKey(block)); });
  }
  std::vector<UnknownSpace::PlacedBlock> blocks;
  const Pose back = T.inverse();
  for (const std::uint64_t key : reached.keys()) {
    const Int3 at = unpackKey(key);
    const SpaceBlock block = blockFrom(known, at, s, back);
    if ((block.free | block.unknown) != 0) blocks.push_back({at, block});
  }
  sortByRegion(blocks);
  map.space.add(blocks);
}

FrameUpdate take(MapData& map, const MapData& other, const Pose& T) {
  Frame frame;
  if (other.trajectory.empty()) return frame.update;
  takeTrajectory(map, other, T);
  map.ground.add(other.ground, T, map.params.approximation.up.normalized());
  takePlanes(map, other, T, frame);
  takeCells(map, other, T, frame);
  if (map.params.unknown_space) takeSpace(map, other, T);
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
  return serializeMap(record);
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
