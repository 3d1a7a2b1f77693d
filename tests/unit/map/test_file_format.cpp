// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// A second reader of .pmap, written from docs/file_format.md: it shares no code with the first.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "map_scene.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using Cell = std::array<int, 3>;

struct Cursor {
  const std::vector<std::uint8_t>& bytes;
  std::size_t at = 0;
  int packed = 0;

  std::uint8_t u8() { return bytes.at(at++); }
  template <typename T>
  T fixed() {
    T value;
    std::memcpy(&value, &bytes.at(at + sizeof value - 1) - (sizeof value - 1), sizeof value);
    at += sizeof value;
    return value;
  }
  double f64() { return fixed<double>(); }
  Vector3 vec3() {
    const double x = f64(), y = f64(), z = f64();
    return {x, y, z};
  }
  std::uint64_t varint() {
    std::uint64_t value = 0;
    int shift = 0;
    std::uint8_t byte = 0x80;
    while (byte & 0x80) {
      byte = u8();
      value |= std::uint64_t{byte & 0x7fu} << shift;
      shift += 7;
    }
    return value;
  }
  int zigzag() {
    const std::uint64_t n = varint();
    return n % 2 == 0 ? static_cast<int>(n / 2) : -static_cast<int>((n + 1) / 2);
  }
  int label() {
    const int l = (bytes.at(at) >> (2 * packed)) & 3;
    packed = (packed + 1) % 4;
    if (packed == 0) ++at;
    return l;
  }
  void align() {
    if (packed != 0) ++at;
    packed = 0;
  }
};

/// side = side of a bundle in cells.
std::vector<Cell> readTree(Cursor& in, int dimensions, int side, int largest_leaf, int leaf) {
  Cell corner{0, 0, 0};
  for (int d = 0; d < dimensions; ++d) corner[static_cast<std::size_t>(d)] = side * in.zigzag();
  const int levels = in.u8();
  std::vector<Cell> cells;
  const auto fill = [&](auto&& self, Cell low, int size) -> void {
    if (size == 1) {
      cells.push_back(low);
      return;
    }
    for (int c = 0; c < 1 << dimensions; ++c) {
      Cell child = low;
      for (int d = 0; d < dimensions; ++d) {
        child[static_cast<std::size_t>(d)] += ((c >> d) & 1) * size / 2;
      }
      self(self, child, size / 2);
    }
  };
  const auto node = [&](auto&& self, Cell low, int size) -> void {
    const int label = in.label();
    if (label == 0) return;
    if (label == leaf) {
      EXPECT_LE(size, largest_leaf);
      fill(fill, low, size);
      return;
    }
    ASSERT_EQ(label, 3);
    ASSERT_GT(size, 1);
    for (int c = 0; c < 1 << dimensions; ++c) {
      Cell child = low;
      for (int d = 0; d < dimensions; ++d) {
        child[static_cast<std::size_t>(d)] += ((c >> d) & 1) * size / 2;
      }
      self(self, child, size / 2);
    }
  };
  node(node, corner, side << levels);
  in.align();
  return cells;
}

std::vector<double> readRuns(Cursor& in, std::size_t count) {
  std::vector<double> values;
  while (values.size() < count) {
    const std::uint64_t length = in.varint();
    const double value = in.u8() / 255.0;
    values.insert(values.end(), length, value);
  }
  EXPECT_EQ(values.size(), count);
  return values;
}

std::map<std::string, std::vector<std::uint8_t>> readSections(
    const std::vector<std::uint8_t>& file) {
  Cursor in{file};
  const std::uint8_t magic[8] = {0x50, 0x4d, 0x41, 0x50, 0x0d, 0x0a, 0x1a, 0x0a};
  for (const std::uint8_t byte : magic) EXPECT_EQ(in.u8(), byte);
  EXPECT_EQ(in.fixed<std::uint32_t>(), 2u);
  std::map<std::string, std::vector<std::uint8_t>> sections;
  while (in.at < file.size()) {
    std::string tag;
    for (int i = 0; i < 4; ++i) tag += static_cast<char>(in.u8());
    const auto checksum = in.fixed<std::uint32_t>();
    const auto size = static_cast<std::ptrdiff_t>(in.fixed<std::uint64_t>());
    const auto begin = file.begin() + static_cast<std::ptrdiff_t>(in.at);
    std::vector<std::uint8_t> payload(begin, begin + size);
    std::uint32_t crc = 0xffffffffu;
    for (const std::uint8_t byte : payload) {
      crc ^= byte;
      for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0xedb88320u : 0u);
    }
    EXPECT_EQ(~crc, checksum);
    sections[tag] = std::move(payload);
    in.at += static_cast<std::size_t>(size);
  }
  return sections;
}

class FileFormat : public testing::TestWithParam<Profile> {};

TEST_P(FileFormat, IsReadByAReaderWrittenFromItsDescription) {
  PlanarMapParams params;
  params.approximation.profile = GetParam();
  PlanarMap map(params);
  for (int i = 0; i < 3; ++i) {
    map.insert(test::look(test::Scene(), test::lookFrom({0.1 * i, 0.0, 1.0}), 0.5 * i).frame());
  }
  auto sections = readSections(map.serialize());
  ASSERT_EQ(sections.size(), 6u);

  Cursor parm{sections["PARM"]};
  EXPECT_EQ(parm.u8(), GetParam() == Profile::Compact ? 1 : 0);
  EXPECT_EQ(parm.u8(), 1);
  EXPECT_EQ(parm.varint(), 1u);
  const double s = parm.f64();
  EXPECT_EQ(s, 0.1);
  EXPECT_EQ(parm.bytes.size(), parm.at + 22 * 8);

  Cursor traj{sections["TRAJ"]};
  ASSERT_EQ(traj.varint(), 3u);
  double at[7] = {};
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(traj.f64(), 0.5 * i);
    for (double& value : at) value += traj.zigzag();
    EXPECT_LT((Vector3(at[0], at[1], at[2]) / 16384.0 - Vector3(0.1 * i, 0.0, 1.0)).norm(), 1e-4);
    const Quaternion turn(Matrix3(test::lookFrom({0.1 * i, 0.0, 1.0}).linear()));
    const Quaternion read(at[6], at[3], at[4], at[5]);
    EXPECT_NEAR(std::abs(turn.dot(read.normalized())), 1.0, 1e-8);
  }
  EXPECT_EQ(traj.at, traj.bytes.size());

  Cursor plan{sections["PLAN"]};
  EXPECT_GE(plan.varint(), map.planes().size());
  ASSERT_EQ(plan.varint(), map.planes().size());
  double planar_area = 0.0;
  for (const MapPlane& plane : map.planes()) {
    EXPECT_EQ(plan.varint(), static_cast<std::uint64_t>(plane.id));
    EXPECT_EQ(plan.varint(), plane.frames);
    const Vector3 origin = plan.vec3();
    Vector3 u, n;
    for (int i = 0; i < 3; ++i) u[i] = plan.fixed<float>();
    for (int i = 0; i < 3; ++i) n[i] = plan.fixed<float>();
    n.normalize();
    u = (u - n.dot(u) * n).normalized();
    const Vector3 v = n.cross(u);
    EXPECT_LT((n - plane.plane.normal).norm(), 1e-12);
    EXPECT_EQ(plan.f64(), plane.moments.weight());
    EXPECT_EQ(plan.vec3(), plane.moments.mean());
    plan.at += 6 * 4;
    plan.zigzag();
    plan.zigzag();
    const std::vector<Cell> cells = readTree(plan, 2, 8, 4, 1);
    const std::vector<double> beliefs = readRuns(plan, cells.size());
    EXPECT_GT(cells.size(), 0u);
    planar_area += static_cast<double>(cells.size()) * s * s;
    for (const Cell& c : cells) {
      const Vector3 centre = origin + (c[0] + 0.5) * s * u + (c[1] + 0.5) * s * v - 0.5 * s * n;
      EXPECT_TRUE(map.isOccupied(centre));
    }
  }
  EXPECT_EQ(plan.at, plan.bytes.size());
  double expected_area = 0.0;
  for (const Cuboid& c : map.cuboids()) {
    if (c.plane_id >= 0) expected_area += c.size.x() * c.size.y();
  }
  EXPECT_LE(planar_area, expected_area + 1e-6);  // small holes are filled
  EXPECT_GE(planar_area, 0.9 * expected_area);

  Cursor cell{sections["CELL"]};
  for (int i = 0; i < 3; ++i) cell.zigzag();
  const std::vector<Cell> cells = readTree(cell, 3, 4, 2, 1);
  const std::vector<double> beliefs = readRuns(cell, cells.size());
  EXPECT_GT(cells.size(), 0u);
  cell.at += (GetParam() == Profile::Paper ? 3 : 1) * cells.size();
  for (const Cell& c : cells) {
    EXPECT_FALSE(map.cuboidsAt(s * Vector3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5), s).empty());
  }
  EXPECT_LE(cell.varint(), 2u);  // one region, changed last by frame 0, 1 or 2
  EXPECT_EQ(cell.at, cell.bytes.size());

  Cursor unknown{sections["UNKN"]};
  const std::vector<Cell> hidden = readTree(unknown, 3, 4, 4, 2);
  EXPECT_EQ(unknown.at, unknown.bytes.size());
  std::size_t not_occupied = 0;
  for (const Cell& c : hidden) {
    const Vector3 centre = s * Vector3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5);
    EXPECT_FALSE(map.isFree(centre));
    not_occupied += map.isUnknown(centre);
  }
  EXPECT_EQ(not_occupied, map.unknownCells());

  Cursor seen{sections["SEEN"]};
  const std::vector<Cell> free = readTree(seen, 3, 4, 4, 1);
  EXPECT_EQ(seen.at, seen.bytes.size());
  for (const Cell& c : free) {
    EXPECT_FALSE(map.isUnknown(s * Vector3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5)));
  }
}

INSTANTIATE_TEST_SUITE_P(Profiles, FileFormat, testing::Values(Profile::Compact, Profile::Paper));

TEST(FileFormat, DescribesTheEmptyMap) {
  auto sections = readSections(PlanarMap().serialize());
  EXPECT_EQ(sections["UNKN"], (std::vector<std::uint8_t>{0, 0, 0, 0, 0}));
  EXPECT_EQ(sections["TRAJ"], (std::vector<std::uint8_t>{0}));
}

}  // namespace
}  // namespace planar_mapping
