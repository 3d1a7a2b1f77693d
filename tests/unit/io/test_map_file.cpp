// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "map_scene.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/map_json.h"
#include "planar_mapping/planes/multi_plane.h"
#include "temporary_directory.h"

namespace planar_mapping::io {
namespace {

using namespace test;

PlanarMap smallMap() {
  PlanarMap map;
  map.insert(look(Scene(), lookFrom({0.0, 0.0, 1.0})).frame());
  return map;
}

TEST(MapFile, GivesBackWhatWasSaved) {
  const TemporaryDirectory directory;
  const std::string path = directory / "map.pmap";
  const PlanarMap map = smallMap();
  saveMap(map, path);
  EXPECT_EQ(loadMap(path).serialize(), map.serialize());
  EXPECT_EQ(loadMap(path, 1).serialize(), map.serialize());
  EXPECT_EQ(loadMap(path).params().approximation.threads, 0);
  EXPECT_EQ(std::filesystem::file_size(path), map.serialize().size());
}

TEST(MapFile, NamesThePathAndTheProblemOfABadFile) {
  const TemporaryDirectory directory;
  const std::string path = directory / "bad.pmap";
  EXPECT_THROW(loadMap(path), IoError);
  EXPECT_THROW(loadMap(directory.path()), IoError);
  const auto problem = [&](const std::string& content) -> std::string {
    writeFileAtomically(path, content, Overwrite::Allow);
    try {
      loadMap(path);
    } catch (const IoError& error) {
      EXPECT_EQ(error.path(), path);
      EXPECT_EQ(std::string(error.what()).find(path), 0u);
      return error.what();
    }
    return "";
  };
  EXPECT_NE(problem(""), "");
  EXPECT_NE(problem("# .PCD v0.7\n").find("no planar map"), std::string::npos);
  const std::vector<std::uint8_t> bytes = smallMap().serialize();
  std::string whole(bytes.begin(), bytes.end());
  EXPECT_NE(problem(whole.substr(0, whole.size() / 2)).find("cut short"), std::string::npos);
  whole[whole.size() / 2] = static_cast<char>(whole[whole.size() / 2] ^ 1);
  EXPECT_NE(problem(whole).find("damaged"), std::string::npos);
}

/// Frames of a real sequence with known poses into a map.
PlanarMap mapOfSequence(const std::string& folder, std::size_t step, bool unknown) {
  const Sequence sequence({folder});
  PlanarMapParams params;
  params.max_range = 8.0;
  params.unknown_space = unknown;
  PlanarMap map(params);
  MultiPlaneParams segmentation;
  segmentation.min_inliers = 1000;
  for (std::size_t i = 0; i < sequence.size(); i += step) {
    const Frame frame = sequence.read(i, CloudChannels::none());
    const PlaneSet found = findPlanes(frame.cloud.view(), nullptr, segmentation);
    FrameObservation observation;
    observation.T_world_sensor = frame.T_world_sensor.value();
    observation.timestamp = frame.timestamp;
    observation.points = frame.cloud.view();
    observation.planes = &found.planes;
    observation.camera = frame.camera;
    map.insert(observation);
  }
  return map;
}

TEST(MapFile, HoldsFiveRealFramesInLittleSpace) {
  const std::string folder =
      std::string(PLANAR_MAPPING_SOURCE_DIR) + "/../shared/data/rgbd_icl_five";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no " << folder;
  const PlanarMap map = mapOfSequence(folder, 1, false);
  EXPECT_EQ(map.frames(), 5u);
  EXPECT_GE(map.planes().size(), 6u);
  EXPECT_LT(map.serialize().size(), 11400u);  // OctoMap's .bt of these frames at 0.1 m
  // The world has y down; the room's ceiling and floor are where the data's notes say.
  bool floor = false, ceiling = false;
  for (const MapPlane& plane : map.planes()) {
    const bool is_level = std::abs(plane.plane.normal.y()) > 0.99;
    floor |= is_level && std::abs(plane.plane.signedDistance({0.0, 1.38, 0.0})) < 0.1;
    ceiling |= is_level && std::abs(plane.plane.signedDistance({0.0, -1.13, 0.0})) < 0.1;
  }
  EXPECT_TRUE(floor);
  EXPECT_TRUE(ceiling);
  const PlanarMap loaded = PlanarMap::deserialize(map.serialize().data(), map.serialize().size());
  EXPECT_EQ(loaded.cuboids().size(), map.cuboids().size());
}

TEST(MapFile, KeepsOneFloorOfAWalkAroundACabinet) {
  const std::string folder =
      std::string(PLANAR_MAPPING_SOURCE_DIR) + "/../shared/data/rgbd_tum_cabinet";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no " << folder;
  const PlanarMap map = mapOfSequence(folder, 6, true);
  std::size_t floors = 0;
  for (const MapPlane& plane : map.planes()) {
    const bool is_level = plane.plane.normal.z() > 0.98;
    floors += is_level && plane.frames >= 5 &&
              std::abs(plane.plane.signedDistance(plane.moments.mean())) < 0.05 &&
              std::abs(plane.moments.mean().z()) < 0.08;
  }
  EXPECT_EQ(floors, 1u);
}

std::string mapToJson(const PlanarMap& map, const std::string& frame_id = "map") {
  std::string text;
  writeMapJson(map, frame_id, [&text](std::string_view part) { text += part; });
  return text;
}

TEST(MapJson, HoldsEveryCuboidExactly) {
  const PlanarMap map = smallMap();
  const nlohmann::json json = nlohmann::json::parse(mapToJson(map));
  const std::vector<Cuboid> unknown = map.unknownCuboids();
  EXPECT_EQ(json.at("resolution_m").get<double>(), 0.1);
  EXPECT_EQ(json.at("frame_id"), "map");
  EXPECT_EQ(json.at("unit"), "m");
  EXPECT_EQ(json.at("up"), nlohmann::json({0.0, 0.0, 1.0}));
  EXPECT_EQ(json.at("frames").get<int>(), 1);
  EXPECT_EQ(json.at("unseen").get<std::string>(), "unknown");
  ASSERT_EQ(json.at("cuboids").size(), map.cuboids().size() + unknown.size());
  ASSERT_GT(unknown.size(), 0u);
  for (std::size_t i = 0; i < json.at("cuboids").size(); ++i) {
    const std::size_t occupied = map.cuboids().size();
    const Cuboid& expected = i < occupied ? map.cuboids()[i] : unknown[i - occupied];
    const nlohmann::json& cuboid = json.at("cuboids")[i];
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(cuboid.at("center")[static_cast<std::size_t>(axis)].get<double>(),
                expected.center[axis]);
      EXPECT_EQ(cuboid.at("size")[static_cast<std::size_t>(axis)].get<double>(),
                expected.size[axis]);
    }
    for (int k = 0; k < 4; ++k) {  // Eigen's coefficients are x, y, z, w
      EXPECT_EQ(cuboid.at("quaternion_xyzw")[static_cast<std::size_t>(k)].get<double>(),
                expected.orientation.coeffs()[k]);
    }
    EXPECT_EQ(cuboid.at("plane_id").get<int>(), expected.plane_id);
    EXPECT_EQ(cuboid.at("probability").get<float>(), expected.probability);
    EXPECT_EQ(cuboid.at("state").get<std::string>(), i < occupied ? "occupied" : "unknown");
  }
}

TEST(MapJson, SaysWhetherUnknownSpaceIsListed) {
  const PlanarMap map = smallMap();
  for (const bool is_listed : {true, false}) {
    std::string text;
    writeMapJson(
        map, "map", [&text](std::string_view part) { text += part; },
        map.unknownCells() - (is_listed ? 0 : 1));
    const nlohmann::json json = nlohmann::json::parse(text);
    EXPECT_EQ(json.at("unknown_space").get<std::string>(), is_listed ? "listed" : "not listed");
    EXPECT_EQ(json.at("cuboids").size(),
              map.cuboids().size() + (is_listed ? map.unknownCuboids().size() : 0));
  }
}

TEST(MapJson, TellsFrameAndUpAxis) {
  PlanarMapParams params;
  params.approximation.up = -Vector3::UnitY();
  const nlohmann::json json = nlohmann::json::parse(mapToJson(PlanarMap(params), "camera/left"));
  EXPECT_EQ(json.at("frame_id"), "camera/left");
  EXPECT_EQ(json.at("up"), nlohmann::json({0.0, -1.0, 0.0}));
}

TEST(MapJson, HoldsThePlanes) {
  const PlanarMap map = smallMap();
  const nlohmann::json json = nlohmann::json::parse(mapToJson(map));
  ASSERT_EQ(json.at("planes").size(), map.planes().size());
  for (std::size_t i = 0; i < map.planes().size(); ++i) {
    const nlohmann::json& plane = json.at("planes")[i];
    EXPECT_EQ(plane.at("id").get<int>(), map.planes()[i].id);
    EXPECT_EQ(plane.at("coefficients")[3].get<double>(), map.planes()[i].plane.offset);
  }
}

TEST(MapJson, TextComesInSmallParts) {
  PlanarMapParams params;
  params.approximation.resolution = 0.025;
  PlanarMap map(params);
  map.insert(test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.0})).frame());
  std::string text;
  std::size_t largest = 0;
  writeMapJson(map, "map", [&](std::string_view part) {
    text += part;
    largest = std::max(largest, part.size());
  });
  EXPECT_EQ(text, mapToJson(map));
  ASSERT_GT(text.size(), 200000u);
  EXPECT_LT(largest, 70000u);
}

TEST(MapJson, IsValidForAnEmptyMap) {
  const nlohmann::json json = nlohmann::json::parse(mapToJson(PlanarMap()));
  EXPECT_TRUE(json.at("cuboids").empty());
  EXPECT_TRUE(json.at("planes").empty());
}

}  // namespace
}  // namespace planar_mapping::io
