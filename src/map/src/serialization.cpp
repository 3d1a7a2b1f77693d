// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "serialization.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "belief.h"
#include "label_tree.h"

namespace planar_mapping::detail {
namespace {

constexpr std::uint8_t kMagic[8] = {'P', 'M', 'A', 'P', '\r', '\n', 0x1a, '\n'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kSectionHeader = 16;  ///< tag, CRC-32, size

void writeVector(ByteWriter& out, const Vector3& v) {
  for (int i = 0; i < 3; ++i) out.f64(v[i]);
}
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

// Parameters ---------------------------------------------------------------------------------

void writeParams(const PlanarMapParams& p, ByteWriter& out) {
  const CuboidApproximationParams& a = p.approximation;
  out.u8(static_cast<std::uint8_t>(a.profile));
  out.u8(p.unknown_space ? 1 : 0);
  out.varint(static_cast<std::uint64_t>(a.min_points_per_cell));
  for (const double v : {a.resolution,
                         a.thickness,
                         a.density_threshold,
                         a.min_width,
                         a.min_height,
                         a.hole_size,
                         a.absorption,
                         a.up.x(),
                         a.up.y(),
                         a.up.z(),
                         p.association_angle,
                         p.association_offset,
                         p.association_gap,
                         p.unknown_resolution,
                         p.max_range,
                         p.min_probability,
                         p.belief_gain,
                         p.miss_factor,
                         p.refit_tolerance,
                         p.range_image_step}) {
    out.f64(v);
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
                    &p.refit_tolerance,
                    &p.range_image_step}) {
    *v = in.f64();
  }
  in.end();
  p.validate();
  return p;
}

// Trajectory ---------------------------------------------------------------------------------

void writeTrajectory(const MapData& map, ByteWriter& out) {
  out.varint(map.trajectory.size());
  for (std::size_t i = 0; i < map.trajectory.size(); ++i) {
    out.f64(map.trajectory[i].first);
    writeVector(out, map.sensors[i]);
    for (int k = 0; k < 4; ++k) out.f64(map.orientations[i].coeffs()[k]);
  }
}

void readTrajectory(MapData& map, ByteReader& in) {
  const std::size_t n = in.count(64);
  for (std::size_t i = 0; i < n; ++i) {
    const double timestamp = readFinite(in);
    const Vector3 position = readVector(in);
    Quaternion q;
    for (int k = 0; k < 4; ++k) q.coeffs()[k] = readFinite(in);
    if (!(std::abs(q.norm() - 1.0) < 1e-9)) in.fail("holds a quaternion of another length than 1");
    map.addPose(timestamp, q, position);
  }
  in.end();
}

// Beliefs: runs of equal bytes ----------------------------------------------------------------

void writeRuns(const std::vector<std::uint8_t>& values, ByteWriter& out) {
  for (std::size_t i = 0; i < values.size();) {
    std::size_t end = i + 1;
    while (end < values.size() && values[end] == values[i]) ++end;
    out.varint(end - i);
    out.u8(values[i]);
    i = end;
  }
}

/// Calls take(value) for each of \p count values.
template <typename Take>
void readRuns(std::size_t count, ByteReader& in, Take&& take) {
  while (count > 0) {
    const std::uint64_t run = in.varint();
    const std::uint8_t value = in.u8();
    if (run == 0 || run > count) in.fail("has a run of beliefs of the wrong length");
    if (value == 0) in.fail("gives an occupied cell no belief");
    for (std::uint64_t i = 0; i < run; ++i) take(value);
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

// Planes -------------------------------------------------------------------------------------

void writePlane(const PlaneLayer& layer, ByteWriter& out) {
  out.varint(static_cast<std::uint64_t>(layer.info.id));
  out.varint(layer.info.frames);
  writeVector(out, layer.frame.origin);
  for (const float axis : layer.axes) out.f32(axis);
  const PlaneMoments& m = layer.info.moments;
  out.f64(m.weight());
  writeVector(out, m.mean());
  for (int r = 0; r < 3; ++r) {
    for (int c = r; c < 3; ++c) out.f32(static_cast<float>(m.scatter()(r, c)));
  }
  out.zigzag(layer.anchor_a / 8);
  out.zigzag(layer.anchor_b / 8);

  std::vector<CellBundle> bundles;
  for (std::size_t i = 0; i < layer.tiles.size(); ++i) {
    if (layer.tiles.value(i).occupied == 0) continue;
    CellBundle b;
    unpackKey(layer.tiles.key(i), b.at.x, b.at.y);
    b.cells = layer.tiles.value(i).occupied;
    bundles.push_back(b);
  }
  writeTree(TreeKind::Quadtree, bundles, Label::Occupied, out);
  std::vector<std::uint8_t> beliefs;
  const RasterTile* tile = nullptr;
  Int3 last{INT32_MIN, 0, 0};
  forEachCell(TreeKind::Quadtree, bundles, [&](const CellBundle& b, int bit) {
    if (!(b.at == last)) tile = layer.tiles.find(packKey(b.at.x, b.at.y));
    last = b.at;
    beliefs.push_back(tile->belief[static_cast<std::size_t>(bit)]);
  });
  writeRuns(beliefs, out);
}

PlaneLayer readPlane(ByteReader& in) {
  PlaneLayer layer;
  const std::uint64_t id = in.varint();
  const std::uint64_t frames = in.varint();
  if (id > INT32_MAX || frames > UINT32_MAX) in.fail("holds a number that is too large");
  layer.info.id = static_cast<std::int32_t>(id);
  layer.info.frames = static_cast<std::uint32_t>(frames);
  const Vector3 origin = readVector(in);
  PlaneAxes axes;
  for (float& axis : axes) axis = in.f32();
  const Vector3 u(axes[0], axes[1], axes[2]);
  const Vector3 n(axes[3], axes[4], axes[5]);
  constexpr double kTolerance = 1e-6;
  if (!(std::abs(u.norm() - 1.0) < kTolerance) || !(std::abs(n.norm() - 1.0) < kTolerance) ||
      !(std::abs(u.dot(n)) < kTolerance)) {
    in.fail("has a plane whose axes are not orthonormal");
  }
  layer.setFrame(origin, axes);
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
  layer.info.moments = PlaneMoments::fromSums(weight, Vector3::Zero(), scatter, mean);
  layer.anchor_a = 8 * in.within(-2 * kLatticeLimit / 8, 2 * kLatticeLimit / 8);
  layer.anchor_b = 8 * in.within(-2 * kLatticeLimit / 8, 2 * kLatticeLimit / 8);

  const std::vector<CellBundle> bundles = readTree(TreeKind::Quadtree, Label::Occupied, in);
  for (const CellBundle& b : bundles) {
    layer.tileAt(b.at.x, b.at.y).occupied = b.cells;
    layer.markDirty(b.at.x, b.at.y);
  }
  // The tiles were added in the order of the tree, so cells come tile by tile.
  std::size_t tile = 0;
  int path = 0;
  const std::uint8_t* order = cellOrder(TreeKind::Quadtree);
  readRuns(countCells(bundles), in, [&](std::uint8_t value) {
    for (;; ++path) {
      if (path == 64) {
        path = 0;
        ++tile;
      }
      if (((layer.tiles.value(tile).occupied >> order[path]) & 1u) != 0) break;
    }
    layer.tiles.value(tile).belief[order[path++]] = value;
  });
  return layer;
}

void writePlanes(const MapData& map, ByteWriter& out) {
  out.varint(static_cast<std::uint64_t>(map.next_plane_id));
  out.varint(map.planes.size());
  for (const PlaneLayer& layer : map.planes) writePlane(layer, out);
}

void readPlanes(MapData& map, ByteReader& in) {
  const std::uint64_t next = in.varint();
  if (next > INT32_MAX) in.fail("holds a number that is too large");
  map.next_plane_id = static_cast<std::int32_t>(next);
  constexpr std::size_t kSmallestPlane = 7 * 8 + 12 * 4 + 8;
  const std::size_t n = in.count(kSmallestPlane);
  for (std::size_t i = 0; i < n; ++i) {
    map.planes.push_back(readPlane(in));
    const std::int32_t id = map.planes[i].info.id;
    if (id >= map.next_plane_id || (i > 0 && id <= map.planes[i - 1].info.id)) {
      in.fail("has plane numbers that do not ascend");
    }
  }
  in.end();
}

// Non-planar cells ---------------------------------------------------------------------------

void writeCells(const MapData& map, ByteWriter& out) {
  const CellLayer& cells = map.cells;
  out.zigzag(cells.anchor.x / 4);
  out.zigzag(cells.anchor.y / 4);
  out.zigzag(cells.anchor.z / 4);
  std::vector<CellBundle> bundles;
  for (std::size_t i = 0; i < cells.blocks.size(); ++i) {
    if (cells.blocks.value(i).occupied == 0) continue;
    bundles.push_back({unpackKey(cells.blocks.key(i)), cells.blocks.value(i).occupied});
  }
  writeTree(TreeKind::Octree, bundles, Label::Occupied, out);
  std::vector<std::uint8_t> beliefs;
  std::vector<std::uint8_t> octants;
  std::vector<std::uint8_t> means;
  forEachCell(TreeKind::Octree, bundles, [&](const CellBundle& b, int bit) {
    const CellBlock& block = *cells.blocks.find(packKey(b.at));
    beliefs.push_back(block.belief[static_cast<std::size_t>(bit)]);
    octants.push_back(block.octants[static_cast<std::size_t>(bit)]);
    if (!block.mean.empty()) {
      const auto& mean = block.mean[static_cast<std::size_t>(bit)];
      means.insert(means.end(), mean.begin(), mean.end());
    }
  });
  writeRuns(beliefs, out);
  for (const std::uint8_t m : map.isCompact() ? octants : means) out.u8(m);
  std::vector<std::uint64_t> regions;
  for (std::size_t r = 0; r < cells.regions.size(); ++r) {
    if (!cells.regions.value(r).cuboids.empty()) regions.push_back(cells.regions.key(r));
  }
  std::sort(regions.begin(), regions.end());
  for (const std::uint64_t key : regions) out.varint(cells.regions.find(key)->frame);
}

void readCells(MapData& map, ByteReader& in) {
  CellLayer& cells = map.cells;
  cells.anchor.x = 4 * in.within(-kLatticeLimit / 2, kLatticeLimit / 2);
  cells.anchor.y = 4 * in.within(-kLatticeLimit / 2, kLatticeLimit / 2);
  cells.anchor.z = 4 * in.within(-kLatticeLimit / 2, kLatticeLimit / 2);
  const std::vector<CellBundle> bundles = readTree(TreeKind::Octree, Label::Occupied, in);
  for (const CellBundle& b : bundles) {
    cells.blockAt(b.at).occupied = b.cells;
    cells.markDirty(b.at, 0);
  }
  std::vector<std::uint8_t> beliefs;
  readRuns(countCells(bundles), in, [&](std::uint8_t value) { beliefs.push_back(value); });
  std::size_t i = 0;
  forEachCell(TreeKind::Octree, bundles, [&](const CellBundle& b, int bit) {
    CellBlock& block = *cells.blocks.find(packKey(b.at));
    block.belief[static_cast<std::size_t>(bit)] = beliefs[i++];
    if (map.isCompact()) {
      const std::uint8_t octants = in.u8();
      if (octants == 0) in.fail("has a cell that holds no point");
      block.octants[static_cast<std::size_t>(bit)] = octants;
      return;
    }
    if (block.mean.empty()) block.mean.resize(64);
    const std::uint8_t* mean = in.take(3);
    block.mean[static_cast<std::size_t>(bit)] = {mean[0], mean[1], mean[2]};
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

// Unknown and free space ------------------------------------------------------------------------

/// The blocks of 4 x 4 x 4 cells of the cubes of 8 x 8 x 8.
std::vector<CellBundle> toBundles(const UnknownSpace& space, bool free) {
  std::vector<CellBundle> bundles;
  for (std::size_t i = 0; i < space.cubes(); ++i) {
    const UnknownSpace::Cube cube = space.cube(i);
    const CubeBits& bits = free ? cube.free : cube.unknown;
    const Int3 at = unpackKey(space.key(i));
    for (int part = 0; part < 8; ++part) {
      const int x = part & 1, y = (part >> 1) & 1, z = part >> 2;
      CellBundle b{{2 * at.x + x, 2 * at.y + y, 2 * at.z + z}, 0};
      for (int slice = 0; slice < 4; ++slice) {
        const std::uint64_t rows =
            bits[static_cast<std::size_t>(4 * z + slice)] >> (32 * y + 4 * x);
        for (int row = 0; row < 4; ++row) {
          b.cells |= ((rows >> (8 * row)) & 0xfu) << (16 * slice + 4 * row);
        }
      }
      if (b.cells != 0) bundles.push_back(b);
    }
  }
  return bundles;
}

void writeSpace(const MapData& map, bool free, ByteWriter& out) {
  std::vector<CellBundle> bundles = toBundles(map.unknown, free);
  writeTree(TreeKind::Space, bundles, free ? Label::Occupied : Label::Unknown, out);
}

void readSpace(MapData& map, bool free, ByteReader& in) {
  readTree(TreeKind::Space, free ? Label::Occupied : Label::Unknown, in, [&](const CellBundle& b) {
    CubeBits bits{};
    const int x = b.at.x & 1, y = b.at.y & 1, z = b.at.z & 1;
    for (int slice = 0; slice < 4; ++slice) {
      std::uint64_t rows = 0;
      for (int row = 0; row < 4; ++row) {
        rows |= ((b.cells >> (16 * slice + 4 * row)) & 0xfu) << (8 * row);
      }
      bits[static_cast<std::size_t>(4 * z + slice)] = rows << (32 * y + 4 * x);
    }
    const Int3 cube{b.at.x >> 1, b.at.y >> 1, b.at.z >> 1};
    if (free) {
      map.unknown.addFree(cube, bits);
    } else {
      map.unknown.addUnknown(cube, bits);
    }
  });
  in.end();
}

// Sections -----------------------------------------------------------------------------------

void writeSection(const char* tag, const ByteWriter& section, ByteWriter& out) {
  for (int i = 0; i < 4; ++i) out.u8(static_cast<std::uint8_t>(tag[i]));
  out.u32(crc32(section.bytes.data(), section.bytes.size()));
  out.u64(section.bytes.size());
  out.bytes.insert(out.bytes.end(), section.bytes.begin(), section.bytes.end());
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

std::vector<std::uint8_t> serializeMap(const MapData& map) {
  ByteWriter out;
  out.bytes.assign(std::begin(kMagic), std::end(kMagic));
  out.u32(kVersion);
  const auto add = [&](const char* tag, auto&& write) {
    ByteWriter section;
    write(section);
    writeSection(tag, section, out);
  };
  add("PARM", [&](ByteWriter& w) { writeParams(map.params, w); });
  add("TRAJ", [&](ByteWriter& w) { writeTrajectory(map, w); });
  add("PLAN", [&](ByteWriter& w) { writePlanes(map, w); });
  add("CELL", [&](ByteWriter& w) { writeCells(map, w); });
  add("UNKN", [&](ByteWriter& w) { writeSpace(map, false, w); });
  add("SEEN", [&](ByteWriter& w) { writeSpace(map, true, w); });
  return std::move(out.bytes);
}

MapData deserializeMap(const std::uint8_t* data, std::size_t size) {
  ByteReader in(data, size, "the map");
  if (size < sizeof kMagic || std::memcmp(data, kMagic, sizeof kMagic) != 0) {
    throw Error("this is no planar map: it does not start as one");
  }
  in.take(sizeof kMagic);
  const std::uint32_t version = in.u32();
  if (version != kVersion) {
    throw Error("this planar map has version " + std::to_string(version) + "; only version " +
                std::to_string(kVersion) + " can be read");
  }
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
  FrameUpdate update;
  rebuildCuboids(map, update);
  return map;
}

}  // namespace planar_mapping::detail
