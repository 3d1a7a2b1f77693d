// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <tuple>

#include "hostile_map_file.h"
#include "map_scene.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace {

using namespace test;

class MapSerialization : public testing::TestWithParam<Profile> {};

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

/// Resolution and distance from the origin, metres.
class FarMap : public testing::TestWithParam<std::tuple<double, double, Profile>> {};

TEST_P(FarMap, IsReadAsItWasWritten) {
  const auto [resolution, offset, profile] = GetParam();
  PlanarMapParams params = PlanarMapParams::of(profile);
  params.approximation.resolution = resolution;
  params.max_range = std::min(10.0, 1000.0 * resolution);
  params.unknown_space = resolution > 0.02;
  PlanarMap map(params);
  Scene scene;
  scene.camera = {40.0, 40.0, 31.5, 23.5, 64, 48};
  for (int i = 0; i < 2; ++i) {
    const Vector3 from(0.1 * i, 0.0, 1.0);
    test::View view = look(scene, lookFrom(from), i);
    view.pose.translation() += Vector3(offset, -offset, 0.5 * offset);
    map.insert(view.frame());
  }
  const Bytes file = map.serialize();
  EXPECT_EQ(load(file).serialize(), file);
  EXPECT_EQ(load(file).cuboids().size(), map.cuboids().size());
  const Bytes finished = map.finished().serialize();
  EXPECT_EQ(load(finished).serialize(), finished);
}

INSTANTIATE_TEST_SUITE_P(Offsets, FarMap,
                         testing::Combine(testing::Values(0.01, 0.1, 1.0, 10.0),
                                          testing::Values(0.0, 500.0, 1e4, 1.0485e5, 1e6, 1e7),
                                          testing::Values(Profile::Compact, Profile::Paper)));

TEST(MapGround, IsKeptByTheFileAndByMerging) {
  // Ground of two frames 4 m apart along x: in the first at z = 0.1, in the second at 0.3 and 2.3.
  std::vector<float> xyz;
  for (int i = 0; i < 200; ++i) {
    xyz.insert(xyz.end(), {0.01f * static_cast<float>(i % 20), 0.01f * static_cast<float>(i / 20),
                           i < 150 ? 0.1f : 2.1f});
  }
  Indices low(150), all(200);
  std::iota(low.begin(), low.end(), 0);
  std::iota(all.begin(), all.end(), 0);
  FrameObservation first;
  first.points = PointsView(xyz.data(), 200);
  first.indices = &low;
  first.ground = &low;
  FrameObservation second = first;
  second.timestamp = 1.0;
  second.ground = &all;
  second.T_world_sensor.translation() = Vector3(4.0, 0.0, 0.2);
  PlanarMap map;
  EXPECT_TRUE(map.ground().empty());
  map.insert(first);
  ASSERT_EQ(1u, map.ground().size());
  EXPECT_EQ(150u, map.ground()[0].points);
  EXPECT_TRUE(map.ground()[0].position.isApprox(Vector3(1.0, 1.0, 0.1), 0.01));
  PlanarMap loaded = load(map.serialize());
  map.insert(second);
  map.insert(second);
  loaded.insert(second);
  loaded.insert(second);
  EXPECT_EQ(map.serialize(), loaded.serialize());
  EXPECT_TRUE(load(map.finished().serialize()).ground().empty());
  const std::vector<GroundPoint> ground = loaded.ground();
  ASSERT_EQ(3u, ground.size());
  EXPECT_TRUE(ground[1].position.isApprox(Vector3(5.0, 1.0, 0.3), 0.01));
  EXPECT_TRUE(ground[2].position.isApprox(Vector3(5.0, 1.0, 2.3), 0.01));
  EXPECT_EQ(300u, ground[1].points);
  EXPECT_EQ(100u, ground[2].points);
  Pose moved = Pose::Identity();
  moved.translation() = Vector3(10.0, 0.0, 0.5);
  PlanarMap merged = map;
  merged.merge(map, moved);
  ASSERT_EQ(6u, merged.ground().size());
  EXPECT_TRUE(merged.ground()[3].position.isApprox(Vector3(11.0, 1.0, 0.6), 0.01));
  EXPECT_TRUE(merged.ground()[5].position.isApprox(Vector3(15.0, 1.0, 2.8), 0.01));
}

TEST(MapOrigin, IsKeptByBothKindsOfFile) {
  PlanarMapParams params;
  EXPECT_EQ(load(PlanarMap(params).serialize()).params().origin, Vector3::Zero());
  params.origin = Vector3(500000.0, 4500000.0, -0.1);
  const PlanarMap map(params);
  EXPECT_EQ(load(map.serialize()).params().origin, params.origin);
  EXPECT_EQ(load(map.finished().serialize()).params().origin, params.origin);
  params.origin.x() = NAN;
  EXPECT_THROW(PlanarMap{params}, ParameterError);
}

/// A file small enough to be spoilt in every way; of a finished map if the parameter is true.
class HostileFile : public testing::TestWithParam<bool> {
 protected:
  HostileFile() {
    test::Scene scene;
    scene.camera = {40.0, 40.0, 31.5, 23.5, 64, 48};
    PlanarMapParams params;
    params.approximation.resolution = 0.5;
    PlanarMap map(params);
    map.insert(test::look(scene, test::lookFrom({0.0, 0.0, 1.0})).frame());
    file_ = GetParam() ? map.finished().serialize() : map.serialize();
    sections_ = sectionsOf(file_);
  }

  Bytes file_;
  Bytes sections_;
};

TEST_P(HostileFile, IsRejectedAtEveryLengthItIsCutTo) {
  test::expectRejectedAtEveryOtherLength(file_);
}

TEST_P(HostileFile, IsRejectedWhenABitFlips) {
  test::expectRejectedWhenABitFlips(file_);
}

TEST_P(HostileFile, DoesNoHarmWhenItsSectionsAreSpoilt) {
  Random random(6);
  for (int i = 0; i < 4000; ++i)
    static_cast<void>(loadsOrFailsCleanly(fileOf(test::spoilt(sections_, 0, random), GetParam())));
}

TEST_P(HostileFile, DoesNoHarmWhenItsCompressedBytesAreSpoilt) {
  Random random(7);
  for (int i = 0; i < 4000; ++i) {
    Bytes spoilt = test::spoilt(file_, test::kHeader, random);
    test::fixChecksum(spoilt);
    static_cast<void>(loadsOrFailsCleanly(spoilt));
  }
}

TEST_P(HostileFile, IsRejectedWhenItsSectionsAreCut) {
  for (std::size_t size = 0; size < sections_.size(); ++size) {
    const Bytes cut(sections_.begin(), sections_.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(loadsOrFailsCleanly(fileOf(cut, GetParam()))) << size;
  }
}

TEST_P(HostileFile, NamesTheSectionThatCountsMoreThanThereIs) {
  for (const std::uint64_t count : {std::uint64_t{1} << 20, std::uint64_t{1} << 40,
                                    std::uint64_t{1} << 62, ~std::uint64_t{0}}) {
    for (const std::string name : {"SPACE", "CELLS", "BELIEFS", "POSES"}) {
      if (GetParam() && name != "SPACE") continue;
      Bytes sections = sections_;
      test::putNumber(sections, sectionAt(sections, name), count, 8);
      EXPECT_NE(problemOf(fileOf(sections, GetParam())).find(name), std::string::npos) << name;
    }
  }
}

TEST_P(HostileFile, NamesTheSectionThatIsMissing) {
  Bytes sections = sections_;
  sections[sectionAt(sections, "SPACE") - 16] = 'X';
  EXPECT_NE(problemOf(fileOf(sections, GetParam())).find("SPACE"), std::string::npos);
}

TEST_P(HostileFile, MayHaveSectionsOfOthers) {
  Bytes sections = sections_;
  const std::string name = "COLOURS";
  sections.insert(sections.end(), name.begin(), name.end());
  sections.resize(sections.size() + 1 + 8);
  EXPECT_TRUE(loadsOrFailsCleanly(fileOf(sections, GetParam())));
}

TEST_P(HostileFile, RefusesGroundThatCannotBe) {
  // Two cubes of one point each in the height of their lower corners: x, y, z, points, steps.
  const Bytes sound{0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 128, 128, 0, 0, 0, 0, 0, 0};
  const auto fileWith = [&](const Bytes& content) {
    Bytes sections = sections_;
    const std::string name = "GROUND";
    sections.insert(sections.end(), name.begin(), name.end());
    sections.resize(sections.size() + 2 + 16);
    test::putNumber(sections, sections.size() - 16, 8 + content.size(), 8);
    test::putNumber(sections, sections.size() - 8, 2, 8);
    sections.insert(sections.end(), content.begin(), content.end());
    return fileOf(sections, GetParam());
  };
  EXPECT_TRUE(loadsOrFailsCleanly(fileWith(sound)));
  if (GetParam()) return;                     // finished maps have none
  for (const std::size_t at : {1, 12, 19}) {  // the same cube, no point, above its cube
    Bytes spoilt = sound;
    spoilt[at] = spoilt[at] == 1 ? 0 : 1;
    EXPECT_NE(problemOf(fileWith(spoilt)).find("GROUND"), std::string::npos) << at;
  }
  EXPECT_NE(problemOf(fileWith(Bytes(sound.begin(), sound.end() - 1))).find("GROUND"),
            std::string::npos);
}

TEST_P(HostileFile, IsRejectedWithAParameterNobodyKnows) {
  Bytes sections = sections_;
  sections[sectionAt(sections, "PARAMS")] = 'x';
  EXPECT_NE(problemOf(fileOf(sections, GetParam())).find("xrame world"), std::string::npos);
}

TEST_P(HostileFile, UnpacksNoMoreThanItsSizeAllows) {
  // A name, a size, nothing else: one section that is skipped.
  Bytes sections = sections_;
  const std::size_t most = test::kFreeSections + 256 * 20000;
  sections.resize(most + 1);
  sections[sections_.size()] = 'X';
  test::putNumber(sections, sections_.size() + 8, sections.size() - sections_.size() - 16, 8);
  const Bytes file = fileOf(sections, GetParam());
  ASSERT_LT(file.size(), 20000u);
  EXPECT_NE(problemOf(file).find("too large"), std::string::npos);
  Bytes claims_more = file_;
  test::putNumber(claims_more, 8, ~std::uint64_t{0}, 8);
  test::fixChecksum(claims_more);
  EXPECT_NE(problemOf(claims_more).find("too large"), std::string::npos);
}

TEST_P(HostileFile, SaysWhatIsWrong) {
  EXPECT_NE(problemOf({'P', 'C', 'D'}).find("no planar map"), std::string::npos);
  Bytes damaged = file_;
  damaged[40] ^= 1u;
  EXPECT_NE(problemOf(damaged).find("checksum"), std::string::npos);
  const Bytes cut(file_.begin(), file_.begin() + static_cast<std::ptrdiff_t>(file_.size() / 2));
  EXPECT_NE(problemOf(cut).find("cut short"), std::string::npos);
  for (const std::uint8_t version : {4, 6}) {
    Bytes other = file_;
    other[4] = version;
    EXPECT_NE(problemOf(other).find("version " + std::to_string(version)), std::string::npos);
  }
  const Bytes version3{'P', 'M', 'A', 'P', '\r', '\n', 0x1a, '\n', 3, 0, 0, 0};
  EXPECT_NE(problemOf(version3).find("version 3"), std::string::npos);
  EXPECT_NE(problemOf({'P', 'B', 'O', 'X', 2, 0}).find("pbox"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Maps, HostileFile, testing::Bool());

TEST(HostileBytes, AreRejected) {
  Bytes file(64u << 20, 0xff);
  EXPECT_FALSE(loadsOrFailsCleanly(file));
  const Bytes start{'P', 'M', 'A', 'P', 5, 0, 0, 0};
  std::copy(start.begin(), start.end(), file.begin());
  EXPECT_FALSE(loadsOrFailsCleanly(file));
  test::fixChecksum(file);
  EXPECT_FALSE(loadsOrFailsCleanly(file));
  Random random(8);
  for (int i = 0; i < 2000; ++i) {
    Bytes sections(random.below(300));
    for (std::uint8_t& byte : sections) byte = static_cast<std::uint8_t>(random.below(256));
    EXPECT_FALSE(loadsOrFailsCleanly(fileOf(sections, random.below(2) != 0)));
  }
}

}  // namespace
}  // namespace planar_mapping
