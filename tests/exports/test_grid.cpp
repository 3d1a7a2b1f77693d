// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// PGM and its YAML, read as map_server and nav2_map_server read them, against maps made by hand.
#include <yaml-cpp/yaml.h>

#include <cstring>
#include <filesystem>
#include <set>

#include "export_scene.h"
#include "plan_scene.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping {
namespace {

using test::box;

/// nav_msgs/OccupancyGrid: the row of smallest y first.
struct Loaded {
  int width = 0, height = 0;
  double resolution = 0.0;
  std::array<double, 3> origin{};
  std::vector<int> data;

  /// The row of largest y first, as one looks at it: # occupied, . free, ? unknown.
  std::vector<std::string> picture() const {
    std::vector<std::string> rows;
    for (int y = height - 1; y >= 0; --y) {
      rows.emplace_back();
      for (int x = 0; x < width; ++x) {
        const int value = data[static_cast<std::size_t>(y * width + x)];
        rows.back() += value == 100 ? '#' : value == 0 ? '.' : value == -1 ? '?' : '!';
      }
    }
    return rows;
  }
};

/// map_io.cpp of nav2_map_server, mode trinary.
Loaded load(const std::string& yaml_path) {
  const YAML::Node yaml = YAML::LoadFile(yaml_path);
  std::set<std::string> keys;
  for (const auto& entry : yaml) keys.insert(entry.first.as<std::string>());
  EXPECT_EQ(keys, (std::set<std::string>{"free_thresh", "image", "mode", "negate",
                                         "occupied_thresh", "origin", "resolution"}));
  Loaded map;
  map.resolution = yaml["resolution"].as<double>();
  for (std::size_t i = 0; i < 3; ++i) map.origin[i] = yaml["origin"][i].as<double>();
  EXPECT_EQ(yaml["mode"].as<std::string>(), "trinary");
  const int negate = yaml["negate"].as<int>();
  const double occupied = yaml["occupied_thresh"].as<double>();
  const double free = yaml["free_thresh"].as<double>();
  EXPECT_EQ(free, 0.196);
  const std::filesystem::path folder = std::filesystem::path(yaml_path).parent_path();
  std::ifstream in(folder / yaml["image"].as<std::string>(), std::ios::binary);
  std::string magic, comment;
  int most = 0;
  in >> magic >> std::ws;
  std::getline(in, comment);
  in >> map.width >> map.height >> most;
  in.get();
  EXPECT_EQ(magic, "P5");
  EXPECT_EQ(comment.substr(0, 1), "#");
  EXPECT_EQ(most, 255);
  map.data.assign(static_cast<std::size_t>(map.width * map.height), 7);
  for (int row = 0; row < map.height; ++row) {
    for (int x = 0; x < map.width; ++x) {
      const double shade = in.get() / 255.0;
      const double p = negate != 0 ? shade : 1.0 - shade;
      map.data[static_cast<std::size_t>((map.height - row - 1) * map.width + x)] = p > occupied
                                                                                       ? 100
                                                                                   : p < free ? 0
                                                                                              : -1;
    }
  }
  EXPECT_TRUE(in.good());
  EXPECT_EQ(in.get(), std::ifstream::traits_type::eof());
  return map;
}

/// A floor, a block on it, a path, and free space over all of it.
io::ExportedMap handMade() {
  io::ExportedMap map;
  PlanSource& plan = map.plan;
  plan.resolution = 0.5;
  plan.occupied = {box({-1.0, 0.5, -0.1}, {2.0, 3.0, 0.0}), box({1.5, 2.5, 0.0}, {2.0, 3.0, 1.0})};
  plan.occupied[0].plane_id = 0;
  plan.floors = {test::measured({-1.0, 0.5, -0.1}, {2.0, 3.0, 0.0}, 0.5)};
  plan.space = {box({-1.0, 0.5, 0.0}, {2.0, 3.0, 3.0}, CellState::Free)};
  plan.path = {{0.25, 1.25, 0.5}};
  return map;
}

TEST(NavigationMap, OriginAndOrderOfRowsAreThoseOfMapServer) {
  const test::Exported file(io::writePgm, handMade(), "m.pgm");
  const Loaded map = load(file / "m.yaml");
  EXPECT_EQ(map.resolution, 0.5);
  EXPECT_EQ(map.origin, (std::array<double, 3>{-1.0, 0.5, 0.0}));
  EXPECT_EQ(map.picture(),
            (std::vector<std::string>{".....#", "......", "......", "......", "......"}));
}

TEST(NavigationMap, YamlNamesAnyFileAndTheRobot) {
  for (const std::string name : {"1", "a b", "null", "it's"}) {
    const test::Exported file(io::writePgm, handMade(), name + ".pgm");
    EXPECT_EQ(load(file / (name + ".yaml")).width, 6) << name;
  }
  const std::string yaml = io::writePgm(handMade(), "m.pgm").at(1);
  EXPECT_NE(yaml.find("# robot 1.2 m high, 0.25 m radius, steps to 0.1 m"), std::string::npos);
  EXPECT_NE(yaml.find("m2 free"), std::string::npos) << yaml;
}

TEST(NavigationMap, MapOfACameraIsTurnedUpright) {
  io::ExportedMap map = handMade();
  const Quaternion turn = turning(Vector3::UnitZ(), -Vector3::UnitY());
  for (std::vector<Cuboid>* list : {&map.plan.occupied, &map.plan.space})
    for (Cuboid& cuboid : *list) {
      cuboid.center = turn * cuboid.center;
      cuboid.orientation = turn * cuboid.orientation;
    }
  MeasuredCells& floor = map.plan.floors[0];
  for (Vector3* axis : {&floor.origin, &floor.u, &floor.v, &floor.n}) *axis = turn * *axis;
  map.plan.path[0] = turn * map.plan.path[0];
  map.plan.up = map.up = -Vector3::UnitY();
  const test::Exported file(io::writePgm, map, "m.pgm");
  const test::Exported upright(io::writePgm, handMade(), "m.pgm");
  EXPECT_EQ(load(file / "m.yaml").picture(), load(upright / "m.yaml").picture());
}

TEST(NavigationMap, DistanceIsToTheNearestOccupiedCell) {
  io::ExportedMap map = handMade();
  map.options.distance = true;
  const std::string npy = io::writePgm(map, "m.pgm").at(2);
  ASSERT_EQ(npy.substr(1, 5), "NUMPY");
  ASSERT_NE(npy.find("'shape': (5, 6)"), std::string::npos);
  float value = 0.0f;  // of the first cell: 5 and 4 cells away
  std::memcpy(&value, npy.data() + npy.size() - 30 * sizeof value, sizeof value);
  EXPECT_NEAR(value, 0.5 * std::hypot(5.0, 4.0), 1e-5);
}

TEST(NavigationMap, StoreysHaveFilesOfTheirOwn) {
  io::ExportedMap map = handMade();
  map.plan.occupied.push_back(box({-1.0, 0.5, 3.4}, {1.0, 3.0, 3.5}));
  map.plan.occupied.back().plane_id = 1;
  map.plan.floors.push_back(test::measured({-1.0, 0.5, 3.4}, {1.0, 3.0, 3.5}, 0.5));
  map.plan.space.push_back(box({-1.0, 0.5, 3.5}, {1.0, 3.0, 6.0}, CellState::Free));
  map.plan.path.emplace_back(0.25, 1.25, 4.0);
  const io::Contents files = io::writePgm(map, "m.pgm");
  ASSERT_EQ(files.size(), 6u);
  EXPECT_EQ(io::exportedFiles("a/m.pgm", true, 2),
            (std::vector<std::string>{"a/m.pgm", "a/m.yaml", "a/m.npy", "a/m_0.pgm", "a/m_0.yaml",
                                      "a/m_0.npy", "a/m_1.pgm", "a/m_1.yaml", "a/m_1.npy"}));
  EXPECT_EQ(files[0], files[4]) << "the path ends on the upper storey";
  EXPECT_NE(files[2], files[4]);
  EXPECT_NE(files[5].find("image: m_1.pgm"), std::string::npos);
  EXPECT_EQ(map.notes.size(), 2u);
}

TEST(NavigationMap, TooManyCellsAreRefused) {
  io::ExportedMap map = handMade();
  map.options.cell = 1e-5;
  try {
    io::writePgm(map, "m.pgm");
    FAIL();
  } catch (const ParameterError& error) {
    EXPECT_NE(std::string(error.what()).find("--cell 0.0"), std::string::npos) << error.what();
  }
}

TEST(NavigationMap, OfNothingIsOneUnknownCell) {
  const test::Exported file(io::writePgm, io::ExportedMap(), "m.pgm");
  EXPECT_EQ(load(file / "m.yaml").picture(), (std::vector<std::string>{"?"}));
}

TEST(FloorPlan, HasAWallOfTwoFacesAndItsDoorway) {
  io::ExportedMap map = handMade();
  PlanSource& plan = map.plan;
  plan.resolution = 0.1;
  plan.floors = {test::measured({-1.0, 0.5, -0.1}, {2.0, 3.0, 0.0}, 0.1)};
  plan.occupied.pop_back();
  const Quaternion east(Eigen::AngleAxisd(M_PI_2, Vector3::UnitY()));
  for (const double y : {0.9, 2.6}) {  // a gap from 1.3 to 2.2
    for (const double side : {1.0, -1.0}) {
      Cuboid face;
      face.center = {1.0 + 0.1 * side, y, 1.0};
      face.orientation = side > 0.0 ? east : Quaternion(east * Quaternion(0.0, 1.0, 0.0, 0.0));
      face.size = {2.0, 0.8, 0.02};
      face.plane_id = side > 0.0 ? 1 : 2;
      plan.occupied.push_back(face);
    }
  }
  const std::string svg = io::writeSvg(map, "m.svg").at(0);
  const std::string dxf = io::writeDxf(map, "m.dxf").at(0);
  const auto count = [](const std::string& text, const std::string& word) {
    int n = 0;
    for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; ++at) ++n;
    return n;
  };
  EXPECT_EQ(count(svg, "class=\"wall\""), 2) << svg;
  EXPECT_EQ(count(svg, "class=\"opening\""), 1) << svg;
  EXPECT_EQ(count(dxf, "POLYLINE"), 3);
}

}  // namespace
}  // namespace planar_mapping
