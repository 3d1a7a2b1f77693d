// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "hostile_map_file.h"
#include "map_scene.h"
#include "noisy_sequence.h"
#include "pbox_reader.h"
#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/map/map_query.h"

namespace planar_mapping {
namespace {

using test::Bytes;
using test::crc;
using test::load;
using test::loadsOrFailsCleanly;
using test::Number;
using test::PboxReader;

constexpr std::size_t kHeader = 9;  ///< magic, version, CRC-32

PlanarMap mapOf(double resolution, Profile profile = Profile::Compact) {
  test::Scene scene;
  scene.camera = {80.0, 80.0, 63.5, 47.5, 128, 96};
  PlanarMapParams params;
  params.approximation.resolution = resolution;
  params.approximation.profile = profile;
  PlanarMap map(params);
  for (int i = 0; i < 3; ++i) {
    map.insert(test::look(scene, test::lookFrom({0.1 * i, 0.0, 1.0}, 0.3 * i), i).frame());
  }
  return map;
}

Bytes fileOf(const Bytes& payload) {
  const std::uint8_t start[5] = {'P', 'B', 'O', 'X', 2};
  const std::uint32_t checksum = crc(payload.data(), payload.size());
  Bytes file(kHeader + payload.size());
  std::memcpy(file.data(), start, 5);
  std::memcpy(file.data() + 5, &checksum, 4);
  std::copy(payload.begin(), payload.end(), file.begin() + kHeader);
  return file;
}

void fixChecksum(Bytes& file) {
  file = fileOf(Bytes(file.begin() + kHeader, file.end()));
}

Bytes smallFile() {
  return mapOf(0.5).finished().serialize();
}

void expectRead(const PlanarMap& finished) {
  const PboxReader read(finished.serialize());
  EXPECT_EQ(read.in.end(), read.in.bytes.size());
  EXPECT_EQ(read.resolution, finished.params().approximation.resolution);
  EXPECT_TRUE(read.has_unknown);
  ASSERT_EQ(read.cuboids.size(), finished.cuboids().size());
  for (std::size_t i = 0; i < read.cuboids.size(); ++i) {
    const Cuboid& a = read.cuboids[i];
    const Cuboid& b = finished.cuboids()[i];
    EXPECT_LT((a.center - b.center).norm(), 1e-12);
    EXPECT_LT((a.size - b.size).norm(), 1e-12);
    EXPECT_LT((a.orientation.toRotationMatrix() - b.orientation.toRotationMatrix()).norm(), 1e-12);
    EXPECT_EQ(a.plane_id, b.plane_id);
  }
  std::size_t not_occupied = 0;
  for (const auto& [c, value] : read.space) {
    const Vector3 centre = read.resolution * Vector3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5);
    not_occupied += value == 2 && finished.isUnknown(centre) ? 1 : 0;
    EXPECT_TRUE(value == 2 || !finished.isUnknown(centre));
  }
  EXPECT_EQ(not_occupied, finished.unknownCells());
}

TEST(FinishedFile, IsReadByAReaderWrittenFromItsDescription) {
  for (const double resolution : {0.05, 0.1, 0.5}) expectRead(mapOf(resolution).finished());
  expectRead(mapOf(0.1, Profile::Paper).finished());
}

TEST(FinishedFile, OfVersionOneHasNoCuboidsThatReachFartherBeforeNoisyPlanes) {
  constexpr double kCell = 0.05;  // points of the walls scatter over several
  const auto thickest = [](const PlanarMap& finished) {
    double most = 0.0;
    for (const Cuboid& c : finished.cuboids()) {
      // Boxes on planes are not tilted.
      const Matrix3 axes = c.orientation.toRotationMatrix();
      const bool is_tilted = !axes.isApprox(axes.array().round().matrix(), 1e-6);
      if (c.plane_id >= 0 && is_tilted) most = std::max(most, c.size.z());
    }
    return most;
  };
  Bytes file = test::noisyMap(kCell).finished().serialize();
  const PlanarMap now = load(file);
  EXPECT_GT(thickest(now), 1.21 * kCell);
  file[4] = 1;
  const PlanarMap before = load(file);
  EXPECT_EQ(before.cuboids().size(), now.cuboids().size());
  EXPECT_NEAR(thickest(before), 1.2 * kCell, 1e-9);
  EXPECT_EQ(before.serialize(), file);
  file[4] = 3;
  EXPECT_THROW(load(file), Error);
}

TEST(FinishedFile, IsRejectedAtEveryLengthItIsCutTo) {
  test::expectRejectedAtEveryOtherLength(smallFile());
}

TEST(FinishedFile, IsRejectedWhenABitFlips) {
  test::expectRejectedWhenABitFlips(smallFile());
}

TEST(FinishedFile, DoesNoHarmWhenItsChecksumIsRight) {
  // Most do not end where their bytes do.
  EXPECT_LT(test::loadedWhenSpoilt(mapOf(0.25).finished().serialize(), kHeader, fixChecksum), 400u);
}

TEST(FinishedFile, DoesNoHarmWhenItIsRandomBytes) {
  Random random(8);
  for (int i = 0; i < 2000; ++i) {
    Bytes payload(random.below(300));
    for (std::uint8_t& byte : payload) byte = static_cast<std::uint8_t>(random.below(256));
    static_cast<void>(loadsOrFailsCleanly(fileOf(payload)));
  }
  for (const std::uint8_t value : {0, 255}) {
    EXPECT_FALSE(loadsOrFailsCleanly(fileOf(Bytes(64u << 20, value))));
  }
}

TEST(FinishedFile, IsRejectedWithHugeNumbers) {
  for (const std::uint64_t count : {std::uint64_t{1} << 20, std::uint64_t{1} << 40,
                                    std::uint64_t{1} << 62, ~std::uint64_t{0}}) {
    test::PmapBits planes, boxes, others;
    PboxReader of_planes, of_boxes, of_others;
    of_planes.writeStart(planes);
    of_planes.plane_count.code(planes, count);
    EXPECT_FALSE(loadsOrFailsCleanly(fileOf(planes.finish())));
    of_boxes.writeStart(boxes);
    of_boxes.plane_count.code(boxes, 0);
    of_boxes.box_count.code(boxes, count);
    EXPECT_FALSE(loadsOrFailsCleanly(fileOf(boxes.finish())));
    of_others.writeStart(others);
    of_others.plane_count.code(others, 0);
    of_others.box_count.code(others, 0);
    of_others.free_count.code(others, count);
    EXPECT_FALSE(loadsOrFailsCleanly(fileOf(others.finish())));
  }
}

/// Boxes of one half cell, all in the same place: they take next to no bits.
Bytes pileOf(std::uint64_t count, std::size_t padding) {
  test::PmapBits bits;
  PboxReader models;
  models.writeStart(bits);
  models.plane_count.code(bits, 0);
  models.box_count.code(bits, count);
  for (int axis = 0; axis < 3; ++axis) {
    models.corners.low[static_cast<std::size_t>(axis)].codeSigned(bits, 0);
    models.corners.size[static_cast<std::size_t>(axis)].code(bits, 0);
  }
  for (std::uint64_t i = 0; i < count; ++i) {
    models.edges[2][0].code(bits, 0);
    models.edges[1][1].code(bits, 0);
    models.edges[0][1].code(bits, 0);
    models.on_plane.code(bits, false);
  }
  models.free_count.code(bits, 0);
  models.space_lattice.writeNothing(bits);
  Bytes payload = bits.finish();
  payload.resize(std::max(payload.size(), padding), 0);
  return fileOf(payload);
}

TEST(FinishedFile, MayStandForNoMoreCuboidsThanItsSizeAllows) {
  // 64 are free, eight more must be paid for by a byte.
  EXPECT_TRUE(loadsOrFailsCleanly(pileOf(64, 0)));
  EXPECT_FALSE(loadsOrFailsCleanly(pileOf(4064, 0)));
  EXPECT_TRUE(loadsOrFailsCleanly(pileOf(4064, 500)));
  EXPECT_FALSE(loadsOrFailsCleanly(pileOf(4064, 501)));  // not so many
  EXPECT_EQ(load(pileOf(4064, 500)).cuboids().size(), 4064u);
}

TEST(FinishedFile, MayHoldHugeBoxesWithoutHarm) {
  test::PmapBits bits;
  PboxReader models;
  models.writeStart(bits);
  models.plane_count.code(bits, 0);
  models.box_count.code(bits, 1);
  for (Number& low : models.corners.low) low.codeSigned(bits, -(1 << 21));
  models.edges[2][0].code(bits, (1 << 22) - 1);
  models.edges[1][5].code(bits, (1 << 22) - 1);
  models.edges[0][5].code(bits, (1 << 22) - 1);
  models.on_plane.code(bits, false);
  models.free_count.code(bits, 0);
  models.space_lattice.writeNothing(bits);
  const PlanarMap map = load(fileOf(bits.finish()));
  ASSERT_EQ(map.cuboids().size(), 1u);
  EXPECT_TRUE(map.isOccupied({1000.0, -1000.0, 0.0}));
  EXPECT_EQ(map.unknownCells(), 0u);
  EXPECT_THROW(compareMaps(map, map), ParameterError);
}

TEST(FinishedFile, SaysWhatIsWrong) {
  test::expectSaysWhatIsWrong(smallFile(), 4, 3);
}

}  // namespace
}  // namespace planar_mapping
