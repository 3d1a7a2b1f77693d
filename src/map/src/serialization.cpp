// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "serialization.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "sections.h"

namespace planar_mapping::detail {
namespace {

constexpr std::uint8_t kMagic[8] = {'P', 'M', 'A', 'P', '\r', '\n', 0x1a, '\n'};
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kSectionHeader = 16;  ///< tag, CRC-32, size

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
                         p.first_belief,
                         p.noise_factor,
                         p.min_cell_share,
                         p.refit_tolerance,
                         p.range_image_step,
                         a.rectangle_cells}) {
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
                    &p.first_belief,
                    &p.noise_factor,
                    &p.min_cell_share,
                    &p.refit_tolerance,
                    &p.range_image_step,
                    &a.rectangle_cells}) {
    *v = in.f64();
  }
  in.end();
  p.validate();
  return p;
}

// Trajectory ---------------------------------------------------------------------------------

void writeTrajectory(const MapData& map, ByteWriter& out) {
  out.varint(map.trajectory.size());
  StoredPose last;
  for (const StoredPose& pose : map.trajectory) {
    out.f64(pose.timestamp);
    for (std::size_t k = 0; k < 3; ++k) out.zigzag(pose.position[k] - last.position[k]);
    for (std::size_t k = 0; k < 4; ++k) out.zigzag(pose.orientation[k] - last.orientation[k]);
    last = pose;
  }
}

void readTrajectory(MapData& map, ByteReader& in) {
  constexpr std::size_t kSmallestPose = 15;
  const std::size_t n = in.count(kSmallestPose);
  StoredPose pose;
  for (std::size_t i = 0; i < n; ++i) {
    pose.timestamp = readFinite(in);
    for (std::int64_t& coordinate : pose.position) {
      constexpr std::int64_t kFarthest = std::int64_t{1} << 61;
      const std::int64_t step = in.zigzag();
      if (step < -kFarthest || step > kFarthest) in.fail("holds a pose outside the world");
      coordinate += step;
      if (coordinate < -kFarthest || coordinate > kFarthest) {
        in.fail("holds a pose outside the world");
      }
    }
    double norm = 0.0;
    for (std::int16_t& part : pose.orientation) {
      const std::int64_t value = part + in.within(-2 * INT16_MAX, 2 * INT16_MAX);
      if (value < -INT16_MAX || value > INT16_MAX) in.fail("holds a quaternion that is none");
      part = static_cast<std::int16_t>(value);
      norm += static_cast<double>(value * value);
    }
    if (!(std::abs(std::sqrt(norm) / INT16_MAX - 1.0) < 1e-3)) {
      in.fail("holds a quaternion of another length than 1");
    }
    map.trajectory.push_back(pose);
  }
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
  tidyMap(map, update);
  return map;
}

}  // namespace planar_mapping::detail
