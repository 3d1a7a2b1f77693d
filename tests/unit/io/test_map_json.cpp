// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/map_json.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <clocale>
#include <nlohmann/json.hpp>
#include <string>

#include "map_scene.h"
#include "planar_mapping/core/base/error.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace io {
namespace {

std::string mapToJson(const PlanarMap& map, const std::string& frame_id = "map") {
  std::string text;
  writeMapJson(map, frame_id, [&text](std::string_view part) { text += part; });
  return text;
}

PlanarMap smallMap() {
  PlanarMap map;
  map.insert(test::look(test::Scene(), test::lookFrom({0.0, 0.0, 1.0})).frame());
  return map;
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

TEST(MapJson, DoesNotDependOnTheLocale) {
  const PlanarMap map = smallMap();
  const std::string expected = mapToJson(map);
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8"}) {
    if (std::setlocale(LC_ALL, name) != nullptr) {
      EXPECT_EQ(mapToJson(map), expected);
    }
  }
  std::setlocale(LC_ALL, before.c_str());
}

TEST(MapJson, IsNotOverwrittenUnlessToldSo) {
  const TemporaryDirectory directory;
  const std::string path = directory / "map.json";
  saveMapJson(smallMap(), path);
  EXPECT_THROW(saveMapJson(PlanarMap(), path), IoError);
  saveMapJson(PlanarMap(), path, Overwrite::Allow);
  const std::vector<std::uint8_t> bytes = readWholeFile(path);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), mapToJson(PlanarMap()));
}

}  // namespace
}  // namespace io
}  // namespace planar_mapping
