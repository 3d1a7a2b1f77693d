// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// PGM and its YAML, read as map_server and nav2_map_server read them, against maps made by hand.
#include <yaml-cpp/yaml.h>

#include <filesystem>

#include "evaluation/metrics/cuboid_geometry.h"
#include "export_scene.h"
#include "map_scene.h"
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

/// A floor, a block on it, free space over most of it and low free space at one place.
io::ExportedMap handMade() {
  io::ExportedMap map;
  map.resolution = 0.5;
  map.cuboids = {box({-1.0, 0.5, -0.1}, {1.0, 2.0, 0.0}), box({0.5, 1.5, 0.0}, {1.0, 2.0, 1.0})};
  map.cuboids[0].plane_id = 0;
  map.free = {box({-1.0, 0.5, 0.0}, {1.0, 1.5, 3.0}, CellState::Free),
              box({-1.0, 1.5, 0.0}, {0.0, 2.0, 1.0}, CellState::Free)};
  return map;
}

TEST(NavigationMap, OriginAndOrderOfRowsAreThoseOfMapServer) {
  const test::Exported file(io::writePgm, handMade(), "m.pgm");
  const Loaded map = load(file / "m.yaml");
  EXPECT_EQ(map.resolution, 0.5);
  EXPECT_EQ(map.origin, (std::array<double, 3>{-1.0, 0.5, 0.0}));
  EXPECT_EQ(map.picture(), (std::vector<std::string>{"???#", "....", "...."}));
}

TEST(NavigationMap, OriginIsWrittenAsAPersonWouldWriteIt) {
  io::ExportedMap map = handMade();
  map.resolution = 0.1;
  map.cuboids = {box({-3.3, -0.7, 0.0}, {-3.0, 0.2, 1.0})};
  map.free.clear();
  const std::string yaml = io::writePgm(map, "m.pgm").at(1);
  EXPECT_NE(yaml.find("\norigin: [-3.3, -0.7, 0]\n"), std::string::npos) << yaml;
}

TEST(NavigationMap, YamlNamesAnyFile) {
  for (const std::string name : {"floor #2", "it's: 1", "[a]", "- b", "plain_1"}) {
    const test::Exported file(io::writePgm, handMade(), name + ".pgm");
    EXPECT_EQ(load(file / (name + ".yaml")).width, 4) << name;
  }
}

TEST(NavigationMap, BytesAreThoseThatPlannersKnow) {
  const test::Exported file(io::writePgm, handMade(), "m.pgm");
  std::ifstream in(file.path(), std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(bytes.substr(bytes.size() - 12), std::string("\xcd\xcd\xcd\x00", 4) +
                                                 "\xfe\xfe\xfe\xfe"
                                                 "\xfe\xfe\xfe\xfe");
}

TEST(NavigationMap, BandChoosesTheHeights) {
  io::ExportedMap map = handMade();
  map.cuboids.push_back(box({-1.0, 0.5, 2.5}, {-0.5, 1.0, 2.6}));  // a lamp
  // The frame of a door 2.05 m high, which its cuboid may be below by a quarter of a cell.
  map.cuboids.push_back(box({0.0, 0.5, 1.93}, {0.5, 1.0, 2.2}));
  const auto drawn = [&] {
    const test::Exported file(io::writePgm, map, "m.pgm");
    return load(file / "m.yaml").picture();
  };
  EXPECT_EQ(drawn(), (std::vector<std::string>{"???#", "....", "...."}));
  map.options.band.high = 2.8;
  EXPECT_EQ(drawn(), (std::vector<std::string>{"???#", "....", "#.#."}));
  map.cuboids.pop_back();
  map.options.band = {1.2, 2.2};  // over the block; its cell was never seen
  EXPECT_EQ(drawn(), (std::vector<std::string>{"....", "...."}));
  map.options.band = {-0.05, 0.9};  // the floor itself
  EXPECT_EQ(drawn(), (std::vector<std::string>{"####", "####", "####"}));
  map.options.band = {0.15, 0.9, 0.0};
  EXPECT_EQ(drawn(), (std::vector<std::string>{"..?#", "....", "...."}));
  map.options.band = {2.0, 1.0};
  EXPECT_THROW(io::writePgm(map, "m.pgm"), ParameterError);
}

TEST(NavigationMap, GroundIsTheTopOfALowFloor) {
  io::ExportedMap map = handMade();
  for (std::vector<Cuboid>* list : {&map.cuboids, &map.free}) {
    for (Cuboid& cuboid : *list) cuboid.center.z() -= 1.3;  // as seen from a camera
  }
  map.cuboids.push_back(box({0.0, 1.0, -9.0}, {0.1, 1.1, -8.9}));  // a stray cell
  EXPECT_NEAR(io::gridOf(map).ground, -1.3, 1e-6);                 // heights of places are floats
  const test::Exported file(io::writePgm, map, "m.pgm");
  EXPECT_EQ(load(file / "m.yaml").picture(), (std::vector<std::string>{"???#", "....", "...."}));
}

/// Of a map of these faces, each a plane.
double groundOf(const std::vector<Cuboid>& faces) {
  io::ExportedMap map;
  map.resolution = 0.5;
  map.cuboids = faces;
  test::numberPlanes(map);
  return io::gridOf(map).ground;
}

TEST(NavigationMap, GroundIsTheRoadAndNotTheVergeBelowIt) {
  std::vector<Cuboid> faces = {box({-3.0, -3.0, -0.1}, {3.0, 3.0, 0.0}),  // 36 m2
                               box({3.0, -3.0, -0.6}, {4.0, 2.0, -0.5}),  // 5 m2
                               box({-3.0, 3.0, 0.6}, {3.0, 5.0, 0.7})};   // no larger: a stage
  EXPECT_NEAR(groundOf(faces), 0.0, 1e-6);
  faces[0] = box({-2.0, -3.0, -0.1}, {2.0, 0.0, 0.0});  // 12 m2 do not outweigh 5
  EXPECT_NEAR(groundOf(faces), -0.5, 1e-6);
  EXPECT_NEAR(groundOf({box({-3.0, -3.0, -0.1}, {3.0, 2.0, 0.0}),    // 30 m2
                        box({3.0, -3.0, -0.48}, {5.0, 3.0, -0.38}),  // 12 m2, not the lowest
                        box({5.0, -3.0, -0.6}, {6.0, -0.5, -0.5}),   // 2.5 m2 each
                        box({5.0, 0.0, -0.7}, {6.0, 2.5, -0.6})}),
              0.0, 1e-6);
}

TEST(NavigationMap, GroundIsTheYardAndNotThePitInIt) {
  std::vector<Cuboid> faces = {box({-5.0, -5.0, -0.1}, {5.0, 5.0, 0.0}),  // 100 m2
                               box({5.0, -5.0, -1.6}, {6.0, 1.0, -1.5}),  // 6 m2
                               box({-5.0, 5.0, 0.7}, {5.0, 10.0, 0.8})};  // no larger: a platform
  EXPECT_NEAR(groundOf(faces), 0.0, 1e-6);
  faces[1] = box({5.0, -5.0, -1.6}, {7.0, 5.0, -1.5});  // 20 m2: a storey below
  EXPECT_NEAR(groundOf(faces), -1.5, 1e-6);
}

TEST(NavigationMap, GroundThatLeansIsAtTheHeightOfMostOfIt) {
  std::vector<Cuboid> faces;
  for (int i = 0; i < 9; ++i) {  // from -0.4 to 0.4, widest at 0
    const double width = 5.0 - std::abs(i - 4);
    faces.push_back(box({2.0 * i, -width, 0.1 * i - 0.5}, {2.0 * i + 2.0, width, 0.1 * i - 0.4}));
  }
  EXPECT_NEAR(groundOf(faces), 0.0, 0.1);
}

TEST(NavigationMap, FollowsTheGroundThatWasRemoved) {
  io::ExportedMap
      map;  // a road 40 m long that falls by 4 m, free over it, with a box on its lower end
  map.resolution = 0.5;
  for (int x = 0; x < 40; x += 2) {
    const double height = -0.1 * (x + 1);
    map.ground.push_back({Vector3(x + 1.0, 1.0, height), 200});
    map.ground.push_back({Vector3(x + 1.0, 1.0, height - 2.0), 3});  // few reflections below
  }
  for (int x = 0; x < 40; ++x) {
    map.free.push_back(
        box({1.0 * x, 0.0, -0.1 * x}, {x + 1.0, 2.0, -0.1 * x + 3.0}, CellState::Free));
  }
  map.cuboids = {box({38.0, 1.0, -3.8}, {38.5, 1.5, -3.0}),
                 box({0.0, 0.0, -9.0}, {0.1, 0.1, -8.9})};
  const io::OccupancyGrid grid = io::gridOf(map);
  EXPECT_NEAR(grid.ground, -2.0, 0.2);
  ASSERT_EQ(std::pair(80u, 4u), std::pair(grid.width, grid.height));
  for (std::uint32_t y = 0; y < 4; ++y) {
    for (std::uint32_t x = 0; x < 80; ++x) {
      const bool is_box = x == 76 && y == 2;
      EXPECT_EQ(grid.at(x, y), is_box ? io::OccupancyGrid::kOccupied : io::OccupancyGrid::kFree);
    }
  }
  const io::GroundHeights heights(map.ground, Vector3::UnitZ(), 7.0);
  EXPECT_NEAR(heights.at({20.5, 1.0, 0.0}), -2.05, 1e-6);
  EXPECT_NEAR(heights.at({20.5, 9.0, 0.0}), -2.05, 1e-6);  // the nearest
  EXPECT_NEAR(heights.at({60.0, 1.0, 0.0}), -3.9, 1e-6);
  map.options.band.ground = -2.0;  // the same everywhere, who asks for it
  EXPECT_EQ(io::gridOf(map).at(0, 0), io::OccupancyGrid::kUnknown);
  for (GroundPoint& point : map.ground) point.points = 0;  // made by hand
  EXPECT_NEAR(io::GroundHeights(map.ground, Vector3::UnitZ(), 7.0).at({20.5, 1.0, 0.0}), -3.0, 1.1);
  map.ground.resize(1);
  EXPECT_EQ(io::GroundHeights(map.ground, Vector3::UnitZ(), 7.0).at({0.5, 0.5, 0.0}), 7.0);
}

TEST(NavigationMap, BetweenAFloorAndAPitIsNoRamp) {
  for (const auto& [depth, between] : {std::pair(0.4, -0.2), {0.8, 0.0}}) {
    std::vector<GroundPoint> ground;
    for (const double x : {1.0, 3.0, 5.0, 7.0})
      for (const double y : {1.0, 3.0})
        ground.push_back({Vector3(x, y, x < 4.0 ? 0.0 : -depth), 200});
    const io::GroundHeights heights(ground, Vector3::UnitZ(), 7.0);
    EXPECT_NEAR(heights.at({4.0, 2.0, 0.0}), between, 1e-6);
    EXPECT_NEAR(heights.at({6.0, 2.0, 0.0}), -depth, 1e-6);
  }
}

/// x right, y down, z forward: forward becomes y of the grid.
TEST(NavigationMap, MapOfACameraIsTurnedUpright) {
  io::ExportedMap map = handMade();
  for (std::vector<Cuboid>* list : {&map.cuboids, &map.free}) {
    for (Cuboid& cuboid : *list) {
      const Vector3 c = cuboid.center, s = cuboid.size;
      cuboid.center = {c.x(), -c.z(), c.y()};
      cuboid.size = {s.x(), s.z(), s.y()};
    }
  }
  map.cuboids[0].plane_id = -1;  // its third axis is no normal any more
  map.up = -Vector3::UnitY();
  const test::Exported file(io::writePgm, map, "m.pgm");
  const Loaded loaded = load(file / "m.yaml");
  EXPECT_EQ(loaded.picture(), (std::vector<std::string>{"???#", "....", "...."}));
  EXPECT_EQ(loaded.origin, (std::array<double, 3>{-1.0, 0.5, 0.0}));
}

TEST(NavigationMap, TurnedWallFillsEveryCellItMeets) {
  io::ExportedMap map;
  map.resolution = 0.1;
  Cuboid wall = box({-2.0, -0.01, 0.0}, {2.0, 0.01, 2.0});
  wall.orientation = Quaternion(Eigen::AngleAxisd(0.6, Vector3::UnitZ()));
  map.cuboids = {wall};
  const io::OccupancyGrid grid = io::gridOf(map);
  std::size_t occupied = 0;
  for (std::uint32_t y = 0; y < grid.height; ++y) {
    for (std::uint32_t x = 0; x < grid.width; ++x) {
      const Vector2 center = grid.origin + grid.cell * Vector2(x + 0.5, y + 0.5);
      const double away = test::distanceTo(wall, {center.x(), center.y(), 1.0});
      const bool is_occupied = grid.at(x, y) == io::OccupancyGrid::kOccupied;
      occupied += is_occupied ? 1 : 0;
      EXPECT_TRUE(is_occupied || away >= 0.05) << x << ' ' << y;
      EXPECT_FALSE(is_occupied && away > 0.071) << x << ' ' << y;
    }
  }
  EXPECT_GT(occupied, 50u);
}

TEST(NavigationMap, KnowsWhatTheMapKnows) {
  const PlanarMap map = test::mapOfFrames(3);
  const io::OccupancyGrid grid = io::occupancyGrid(map);
  std::size_t free = 0, unknown = 0, occupied = 0;
  for (std::uint32_t y = 0; y < grid.height; ++y) {
    for (std::uint32_t x = 0; x < grid.width; ++x) {
      const Vector2 center = grid.origin + grid.cell * Vector2(x + 0.5, y + 0.5);
      int states[3] = {0, 0, 0};
      for (double z = 0.2; z < io::GridBand().high; z += 0.1)
        ++states[static_cast<int>(map.stateAt({center.x(), center.y(), z}))];
      const std::int8_t value = grid.at(x, y);
      free += value == io::OccupancyGrid::kFree ? 1 : 0;
      occupied += value == io::OccupancyGrid::kOccupied ? 1 : 0;
      unknown += value == io::OccupancyGrid::kUnknown ? 1 : 0;
      EXPECT_TRUE(states[1] == 0 || value == io::OccupancyGrid::kOccupied) << center.transpose();
      EXPECT_TRUE(value != io::OccupancyGrid::kFree || states[2] <= 5) << center.transpose();
    }
  }
  EXPECT_GT(free, 200u);
  EXPECT_GT(occupied, 100u);
  EXPECT_GT(unknown, 100u);
}

TEST(NavigationMap, TooManyCellsAreRefused) {
  io::ExportedMap map = handMade();
  map.options.cell = 1e-5;
  try {
    io::gridOf(map);
    FAIL();
  } catch (const ParameterError& error) {
    EXPECT_NE(std::string(error.what()).find("--cell 0.0"), std::string::npos) << error.what();
  }
}

TEST(NavigationMap, OfNothingIsOneUnknownCell) {
  const test::Exported file(io::writePgm, io::ExportedMap(), "m.pgm");
  EXPECT_EQ(load(file / "m.yaml").picture(), (std::vector<std::string>{"?"}));
}

}  // namespace
}  // namespace planar_mapping
