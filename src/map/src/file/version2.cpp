// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Reads version 2 of the map file: sections of plain numbers and of 2-bit labels.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "file/bit_stream.h"
#include "file/label_tree.h"
#include "file/serialization.h"
#include "store/belief.h"

namespace planar_mapping::detail {
namespace {

constexpr std::size_t kSectionHeader = 16;  ///< tag, CRC-32, size

Vector3 readVector(ByteReader& in) {
  Vector3 v;
  for (int i = 0; i < 3; ++i) v[i] = in.f64();
  if (!v.allFinite()) in.fail("holds a vector that is not finite");
  return v;
}
double readFinite(ByteReader& in) {
  const double v = in.f64();
  if (!std::isfinite(v)) in.fail("holds a number that is not finite");
  return v;
}

/// Calls take(value) for each of \p count values.
template <typename Take>
void readRuns(std::size_t count, ByteReader& in, Take&& take) {
  while (count > 0) {
    const std::uint64_t run = in.varint();
    const std::uint8_t value = in.u8();
    if (run == 0 || run > count) in.fail("has a run of beliefs of the wrong length");
    if (value == 0) in.fail("gives an occupied cell no belief");
    const int steps = (value * kCertain + 127) / 255;  // they were in 1/255
    const auto belief = static_cast<std::uint8_t>(std::max(steps, 1));
    for (std::uint64_t i = 0; i < run; ++i) take(belief);
    count -= static_cast<std::size_t>(run);
  }
}

std::size_t countCells(const std::vector<CellBundle>& bundles) {
  std::size_t count = 0;
  for (const CellBundle& b : bundles) {
    count += static_cast<std::size_t>(__builtin_popcountll(b.cells));
  }
  return count;
}

/// Calls visit(bundle, bit) for every set cell, in the order of the tree.
template <typename Visit>
void forEachCell(TreeKind kind, const std::vector<CellBundle>& bundles, Visit&& visit) {
  const std::uint8_t* order = cellOrder(kind);
  for (const CellBundle& b : bundles) {
    for (int path = 0; path < 64; ++path) {
      if (((b.cells >> order[path]) & 1u) != 0) visit(b, order[path]);
    }
  }
}

PlanarMapParams readParams(ByteReader& in) {
  PlanarMapParams p;
  CuboidApproximationParams& a = p.approximation;
  const std::uint8_t profile = in.u8();
  if (profile > 1) in.fail("names an unknown profile");
  a.profile = static_cast<Profile>(profile);
  const std::uint8_t unknown = in.u8();
  if (unknown > 1) in.fail("has a flag that is neither 0 nor 1");
  p.unknown_space = unknown == 1;
  const std::uint64_t points = in.varint();
  if (points > 1000000000u) in.fail("asks for too many points per cell");
  a.min_points_per_cell = static_cast<int>(points);
  for (double* v : {&a.resolution,
                    &a.thickness,
                    &a.density_threshold,
                    &a.min_width,
                    &a.min_height,
                    &a.hole_size,
                    &a.absorption,
                    &a.up.x(),
                    &a.up.y(),
                    &a.up.z(),
                    &p.association_angle,
                    &p.association_offset,
                    &p.association_gap,
                    &p.unknown_resolution,
                    &p.max_range,
                    &p.min_probability,
                    &p.belief_gain,
                    &p.miss_factor,
                    &p.first_belief,
                    &p.noise_factor,
                    &p.min_cell_share,
                    &p.refit_tolerance,
                    &p.range_image_step}) {
    *v = in.f64();
  }
  if (in.left() > 0) a.rectangle_cells = in.f64();  // the last of them had it
  // Those maps had every plane's cuboids behind it, and one share for all cells.
  p.surface_factor = 0.0;
  p.rim_pixels = 1e6;
  in.end();
  p.validate();
  return p;
}

void readTrajectory(MapData& map, ByteReader& in) {
  constexpr std::size_t kSmallestPose = 15;
  const std::size_t n = in.count(kSmallestPose);
  std::array<std::int64_t, 3> position{};     // in 1/16384 m
  std::array<std::int64_t, 4> orientation{};  // in 1/32767
  for (std::size_t i = 0; i < n; ++i) {
    const double timestamp = readFinite(in);
    for (std::int64_t& coordinate : position) {
      constexpr std::int64_t kFarthest = std::int64_t{1} << 61;
      const std::int64_t step = in.zigzag();
      if (step < -kFarthest || step > kFarthest) in.fail("holds a pose outside the world");
      coordinate += step;
      if (coordinate < -kFarthest || coordinate > kFarthest) {
        in.fail("holds a pose outside the world");
      }
    }
    Quaternion turn;
    for (std::size_t k = 0; k < 4; ++k) {
      orientation[k] += in.within(-2 * INT16_MAX, 2 * INT16_MAX);
      if (std::abs(orientation[k]) > INT16_MAX) in.fail("holds a quaternion that is none");
      turn.coeffs()[static_cast<int>(k)] = static_cast<double>(orientation[k]);
    }
    if (!(std::abs(turn.norm() / INT16_MAX - 1.0) < 1e-3)) {
      in.fail("holds a quaternion of another length than 1");
    }
    Vector3 place;
    for (std::size_t k = 0; k < 3; ++k) {
      place[static_cast<int>(k)] = static_cast<double>(position[k]) / 16384.0;
    }
    map.trajectory.push_back(StoredPose::from(timestamp, turn.normalized(), place));
  }
  in.end();
}

PlaneLayer readPlane(ByteReader& in) {
  PlaneLayer layer;
  const std::uint64_t id = in.varint();
  const std::uint64_t frames = in.varint();
  if (id > INT32_MAX || frames > UINT32_MAX) in.fail("holds a number that is too large");
  layer.id = static_cast<std::int32_t>(id);
  layer.frames = static_cast<std::uint32_t>(frames);
  const Vector3 origin = readVector(in);
  std::array<float, 6> axes{};
  for (float& axis : axes) axis = in.f32();
  const Vector3 u(axes[0], axes[1], axes[2]);
  const Vector3 n(axes[3], axes[4], axes[5]);
  constexpr double kTolerance = 1e-6;
  if (!(std::abs(u.norm() - 1.0) < kTolerance) || !(std::abs(n.norm() - 1.0) < kTolerance) ||
      !(std::abs(u.dot(n)) < kTolerance)) {
    in.fail("has a plane whose axes are not orthonormal");
  }
  PlaneFrame frame;
  frame.origin = origin;
  frame.n = n.normalized();
  frame.u = (u - frame.n.dot(u) * frame.n).normalized();
  frame.v = frame.n.cross(frame.u);
  layer.setFrame(frame);
  const double weight = readFinite(in);
  const Vector3 mean = readVector(in);
  Matrix3 scatter;
  for (int r = 0; r < 3; ++r) {
    for (int c = r; c < 3; ++c) {
      scatter(r, c) = scatter(c, r) = in.f32();
      if (!std::isfinite(scatter(r, c))) in.fail("holds a number that is not finite");
    }
  }
  if (weight < 0.0) in.fail("has a plane of negative weight");
  layer.setMoments(PlaneMoments::fromSums(weight, Vector3::Zero(), scatter, mean));
  const std::int32_t anchor_a = in.within(-2 * kLatticeLimit / 8, 2 * kLatticeLimit / 8);
  const std::int32_t anchor_b = in.within(-2 * kLatticeLimit / 8, 2 * kLatticeLimit / 8);
  layer.raster.setAnchor(anchor_a, anchor_b);

  const std::vector<CellBundle> bundles = readTree(TreeKind::Quadtree, Label::Occupied, in);
  std::vector<std::uint8_t> beliefs;
  readRuns(countCells(bundles), in, [&](std::uint8_t value) { beliefs.push_back(value); });
  std::size_t next = 0;
  RasterTile* tile = nullptr;
  Int3 last{INT32_MIN, 0, 0};
  forEachCell(TreeKind::Quadtree, bundles, [&](const CellBundle& b, int bit) {
    if (!(b.at == last)) {
      tile = &layer.raster.tileAt(b.at.x, b.at.y);
      layer.raster.markDirty(b.at.x, b.at.y);
    }
    last = b.at;
    tile->setBelief(static_cast<std::size_t>(bit), beliefs[next++]);
  });
  return layer;
}

void readPlanes(MapData& map, ByteReader& in) {
  const std::uint64_t next = in.varint();
  if (next > INT32_MAX) in.fail("holds a number that is too large");
  map.next_plane_id = static_cast<std::int32_t>(next);
  constexpr std::size_t kSmallestPlane = 7 * 8 + 12 * 4 + 8;
  const std::size_t n = in.count(kSmallestPlane);
  for (std::size_t i = 0; i < n; ++i) {
    map.planes.push_back(readPlane(in));
    const std::int32_t id = map.planes[i].id;
    if (id >= map.next_plane_id || (i > 0 && id <= map.planes[i - 1].id)) {
      in.fail("has plane numbers that do not ascend");
    }
  }
  in.end();
}

void readCells(MapData& map, ByteReader& in) {
  CellLayer& cells = map.cells;
  cells.anchor.x = 4 * in.within(-kLatticeLimit / 2, kLatticeLimit / 2);
  cells.anchor.y = 4 * in.within(-kLatticeLimit / 2, kLatticeLimit / 2);
  cells.anchor.z = 4 * in.within(-kLatticeLimit / 2, kLatticeLimit / 2);
  const std::vector<CellBundle> bundles = readTree(TreeKind::Octree, Label::Occupied, in);
  for (const CellBundle& b : bundles) {
    cells.blockAt(b.at);
    cells.markDirty(b.at, 0);
  }
  std::vector<std::uint8_t> beliefs;
  readRuns(countCells(bundles), in, [&](std::uint8_t value) { beliefs.push_back(value); });
  std::size_t i = 0;
  forEachCell(TreeKind::Octree, bundles, [&](const CellBundle& b, int bit) {
    CellBlock& block = *cells.find(b.at);
    const auto at = static_cast<std::size_t>(bit);
    block.setBelief(at, beliefs[i++]);
    if (map.isCompact()) {
      const std::uint8_t octants = in.u8();
      if (octants == 0) in.fail("has a cell that holds no point");
      block.setOctants(at, octants);
      return;
    }
    const std::uint8_t* mean = in.take(3);
    block.setMean(at, {mean[0], mean[1], mean[2]});
  });
  std::vector<std::uint64_t> regions = cells.regions.keys();
  std::sort(regions.begin(), regions.end());
  for (const std::uint64_t key : regions) {
    const std::uint64_t frame = in.varint();
    if (frame >= map.trajectory.size()) in.fail("names a frame that is not in the trajectory");
    cells.regions.find(key)->frame = static_cast<std::uint32_t>(frame);
  }
  in.end();
}

void readSpace(MapData& map, bool free, ByteReader& in) {
  std::vector<UnknownSpace::PlacedBlock> blocks;
  readTree(TreeKind::Space, free ? Label::Occupied : Label::Unknown, in, [&](const CellBundle& b) {
    blocks.push_back(
        {b.at, free ? UnknownSpace::Block{b.cells, 0} : UnknownSpace::Block{0, b.cells}});
  });
  map.unknown.add(blocks);
  in.end();
}

/// The next section, which must have this tag.
ByteReader readSection(const char* tag, ByteReader& in) {
  const std::string name = "the section " + std::string(tag, 4) + " of the map";
  if (in.left() < kSectionHeader) throw Error(name + " is missing: the map is cut short");
  if (std::memcmp(in.take(4), tag, 4) != 0) throw Error(name + " is not where it belongs");
  const std::uint32_t checksum = in.u32();
  const std::uint64_t size = in.u64();
  if (size > in.left()) throw Error(name + " is longer than the map: it is cut short or damaged");
  const std::uint8_t* bytes = in.take(static_cast<std::size_t>(size));
  if (crc32(bytes, static_cast<std::size_t>(size)) != checksum) {
    throw Error(name + " is damaged: its checksum does not match");
  }
  return ByteReader(bytes, static_cast<std::size_t>(size), name);
}

}  // namespace

MapData readVersion2(const std::uint8_t* data, std::size_t size) {
  ByteReader in(data, size, "the map");
  MapData map;
  ByteReader params = readSection("PARM", in);
  map.params = readParams(params);
  ByteReader trajectory = readSection("TRAJ", in);
  readTrajectory(map, trajectory);
  ByteReader planes = readSection("PLAN", in);
  readPlanes(map, planes);
  ByteReader cells = readSection("CELL", in);
  readCells(map, cells);
  ByteReader unknown = readSection("UNKN", in);
  readSpace(map, false, unknown);
  ByteReader seen = readSection("SEEN", in);
  readSpace(map, true, seen);
  in.end();
  map.commit();
  return map;
}

}  // namespace planar_mapping::detail
