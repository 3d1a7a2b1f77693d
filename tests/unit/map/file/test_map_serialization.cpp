// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "hostile_map_file.h"
#include "map_scene.h"
#include "planar_mapping/core/base/detail/random.h"
#include "planar_mapping/map/planar_map.h"
#include "pmap_reader.h"

namespace planar_mapping {
namespace {

using test::Bytes;
using test::crc;
using test::expectSaysWhatIsWrong;
using test::load;
using test::loadsOrFailsCleanly;
using test::look;
using test::lookFrom;
using test::PmapBits;
using test::PmapModels;
using test::PmapReader;
using test::Scene;

/// A file small enough to be spoilt in every way.
Bytes smallFile() {
  Scene scene;
  scene.camera = {40.0, 40.0, 31.5, 23.5, 64, 48};
  PlanarMapParams params;
  params.approximation.resolution = 0.5;
  PlanarMap map(params);
  map.insert(look(scene, lookFrom({0.0, 0.0, 1.0})).frame());
  return map.serialize();
}

constexpr std::size_t kHeader = 9;  ///< magic, version, CRC-32

/// The file around a payload, with a right checksum.
Bytes fileOf(const Bytes& payload) {
  const std::uint8_t start[5] = {'P', 'M', 'A', 'P', 4};
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

/// Writes what no map would.
struct HostileWriter {
  PmapModels models = PmapReader();
  PmapBits bits;

  /// The usual parameters, compact, unknown space, one point a cell.
  HostileWriter() {
    for (test::KnownValues& known : models.parameters) known.is_value[0].code(bits, true);
    models.compact.code(bits, true);
    models.unknown.code(bits, true);
    models.min_points.codeSigned(bits, 1);
  }
  void frames(std::uint64_t count) { models.frame_count.code(bits, count); }
  void planes(std::uint64_t count) {
    models.next_id.codeSigned(bits, 0);
    models.plane_count.code(bits, count);
  }
};

/// A map of nothing but unknown space: regions in a row that are all of one label.
Bytes mapOfRegions(std::uint64_t count, std::int64_t corner, unsigned label,
                   std::size_t padding = 0) {
  HostileWriter map;
  map.frames(0);
  map.planes(0);
  for (int i = 0; i < 3; ++i) map.models.cells_anchor.codeSigned(map.bits, 0);
  map.models.blocks.writeNothing(map.bits);
  map.models.region_count.code(map.bits, 0);
  map.models.space.writeRegions(map.bits, count, corner, label);
  Bytes payload = map.bits.finish();
  payload.resize(std::max(payload.size(), padding), 0);
  return fileOf(payload);
}

class MapSerialization : public testing::TestWithParam<Profile> {};

TEST_P(MapSerialization, GivesTheSameBytesAndAnswersAfterLoading) {
  const PlanarMap map = test::mapOfFrames(3, GetParam());
  const Bytes bytes = map.serialize();
  const PlanarMap loaded = load(bytes);
  EXPECT_EQ(loaded.serialize(), bytes);
  ASSERT_EQ(loaded.cuboids().size(), map.cuboids().size());
  for (std::size_t i = 0; i < map.cuboids().size(); ++i) {
    const Cuboid& a = map.cuboids()[i];
    const Cuboid& b = loaded.cuboids()[i];
    EXPECT_EQ(a.center, b.center);
    EXPECT_EQ(a.size, b.size);
    EXPECT_EQ(a.orientation.coeffs(), b.orientation.coeffs());
    EXPECT_EQ(a.plane_id, b.plane_id);
    EXPECT_EQ(a.probability, b.probability);
  }
  EXPECT_EQ(loaded.unknownCells(), map.unknownCells());
  EXPECT_EQ(loaded.unknownCuboids().size(), map.unknownCuboids().size());
  ASSERT_EQ(loaded.trajectory().size(), map.trajectory().size());
  for (std::size_t i = 0; i < map.trajectory().size(); ++i) {
    EXPECT_EQ(loaded.trajectory()[i].first, map.trajectory()[i].first);
    EXPECT_EQ(loaded.trajectory()[i].second.matrix(), map.trajectory()[i].second.matrix());
  }
  Random random(3);
  for (int i = 0; i < 5000; ++i) {
    const Vector3 p(random.uniform(-3.0, 3.0), random.uniform(-2.0, 8.0),
                    random.uniform(-1.0, 3.5));
    EXPECT_EQ(loaded.stateAt(p), map.stateAt(p));
    EXPECT_EQ(loaded.occupancyAt(p), map.occupancyAt(p));
  }
}

TEST_P(MapSerialization, GoesOnAfterLoadingAsTheLiveMapDoes) {
  PlanarMap live = test::mapOfFrames(2, GetParam());
  PlanarMap loaded = load(live.serialize());
  for (int i = 2; i < 6; ++i) {
    Scene scene;
    if (i > 3) scene.boxes.erase(scene.boxes.begin() + 1);  // a box is carried away
    const test::View view = look(scene, lookFrom({-0.2 + 0.2 * i, 0.1, 1.0}, 0.1 * i), i);
    live.insert(view.frame());
    loaded.insert(view.frame());
    EXPECT_EQ(loaded.serialize(), live.serialize());
  }
}

INSTANTIATE_TEST_SUITE_P(Profiles, MapSerialization,
                         testing::Values(Profile::Compact, Profile::Paper));

TEST(MapFileSize, IsSmallWithoutUnknownSpace) {
  PlanarMapParams params;
  params.unknown_space = false;
  PlanarMap map(params);
  for (int i = 0; i < 5; ++i) {
    map.insert(look(Scene(), lookFrom({-0.2 + 0.1 * i, 0.0, 1.0})).frame());
  }
  EXPECT_LT(map.serialize().size(), 500u);
}

TEST(HostileMapFile, IsRejectedAtEveryLengthItIsCutTo) {
  test::expectRejectedAtEveryOtherLength(smallFile());
}

TEST(HostileMapFile, IsRejectedWhenABitFlips) {
  test::expectRejectedWhenABitFlips(smallFile());
}

TEST(HostileMapFile, DoesNoHarmWhenItsChecksumIsRight) {
  // Most do not end where their bytes do.
  EXPECT_LT(test::loadedWhenSpoilt(smallFile(), kHeader, fixChecksum), 400u);
}

TEST(HostileMapFile, DoesNoHarmWhenItIsCutWithARightChecksum) {
  const Bytes whole = smallFile();
  constexpr std::size_t kLastCells = 8;  // bytes that may tell the last cells of space only
  for (std::size_t size = kHeader; size < whole.size(); ++size) {
    Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    fixChecksum(cut);
    const bool loaded = loadsOrFailsCleanly(cut);
    EXPECT_TRUE(!loaded || whole.size() - size <= kLastCells) << size;
  }
  for (const std::uint8_t more : {0, 1, 255}) {
    Bytes longer = whole;
    longer.push_back(more);
    fixChecksum(longer);
    EXPECT_FALSE(loadsOrFailsCleanly(longer));
  }
}

TEST(HostileMapFile, IsRejectedWithHugeNumbers) {
  for (const std::uint64_t count : {std::uint64_t{1} << 20, std::uint64_t{1} << 40,
                                    std::uint64_t{1} << 62, ~std::uint64_t{0}}) {
    HostileWriter many_frames;
    many_frames.frames(count);
    EXPECT_FALSE(loadsOrFailsCleanly(fileOf(many_frames.bits.finish())));
    HostileWriter many_planes;
    many_planes.frames(0);
    many_planes.planes(count);
    EXPECT_FALSE(loadsOrFailsCleanly(fileOf(many_planes.bits.finish())));
  }
}

TEST(HostileMapFile, MayStandForNoMoreThanItsSizeAllows) {
  // 64 regions of 32 x 32 x 32 cells are free, each further one must be paid for by a byte.
  EXPECT_TRUE(loadsOrFailsCleanly(mapOfRegions(64, -3, 2)));
  EXPECT_FALSE(loadsOrFailsCleanly(mapOfRegions(2000, -3, 2)));
  EXPECT_TRUE(loadsOrFailsCleanly(mapOfRegions(2000, -3, 2, 2000 - 64)));
  EXPECT_FALSE(loadsOrFailsCleanly(mapOfRegions(2000, -3, 2, 2000 - 63)));  // not so many
  EXPECT_FALSE(loadsOrFailsCleanly(mapOfRegions(1u << 20, -3, 2)));
  const PlanarMap map = load(mapOfRegions(64, -3, 2));
  EXPECT_EQ(map.unknownCells(), 64u * 32u * 32u * 32u);
  EXPECT_TRUE(map.isUnknown({-9.0, -9.0, -9.0}));
}

TEST(HostileMapFile, IsRejectedWithCellsOutsideTheWorldOrLabelsThatCannotBe) {
  constexpr std::int64_t kLast = (1 << 20) / 32 - 1;
  EXPECT_TRUE(loadsOrFailsCleanly(mapOfRegions(1, kLast, 2)));
  EXPECT_FALSE(loadsOrFailsCleanly(mapOfRegions(2, kLast, 2)));
  EXPECT_FALSE(loadsOrFailsCleanly(mapOfRegions(1, kLast + 1, 2)));
  EXPECT_TRUE(loadsOrFailsCleanly(mapOfRegions(1, -kLast - 1, 1)));
  EXPECT_FALSE(loadsOrFailsCleanly(mapOfRegions(1, -kLast - 2, 1)));
  EXPECT_FALSE(loadsOrFailsCleanly(mapOfRegions(1, std::int64_t{1} << 62, 1)));
  EXPECT_FALSE(loadsOrFailsCleanly(mapOfRegions(1, 0, 0)));
  EXPECT_FALSE(loadsOrFailsCleanly(mapOfRegions(1, 0, 3)));
}

TEST(HostileMapFile, IsRejectedWhenItIsSixtyFourMegabytesOfNothing) {
  Bytes file(64u << 20, 0xff);
  EXPECT_FALSE(loadsOrFailsCleanly(file));
  const Bytes whole = smallFile();
  std::copy(whole.begin(), whole.begin() + 5, file.begin());
  EXPECT_FALSE(loadsOrFailsCleanly(file));
  fixChecksum(file);
  EXPECT_FALSE(loadsOrFailsCleanly(file));
  std::fill(file.begin() + kHeader, file.end(), 0);
  fixChecksum(file);
  EXPECT_FALSE(loadsOrFailsCleanly(file));
}

TEST(HostileMapFile, SaysWhatIsWrong) {
  expectSaysWhatIsWrong(smallFile(), 4, 5);
  const Bytes version3{'P', 'M', 'A', 'P', '\r', '\n', 0x1a, '\n', 3, 0,
                       0,   0,   1,   2,   3,    4,    0,    0,    0, 0};
  EXPECT_NE(test::problemOf(version3).find("version 3"), std::string::npos);
}

}  // namespace
}  // namespace planar_mapping
