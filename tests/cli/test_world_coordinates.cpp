// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Clouds and poses in the coordinates of a country (UTM) or of the Earth.
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "cli_fixture.h"
#include "planar_mapping/base/crc32.h"
#include "wide_map.h"

namespace planar_mapping {
namespace {

using Json = nlohmann::json;

constexpr double kEast = 500000.0;
constexpr double kNorth = 4500000.0;

class WorldCoordinates : public CliTest {
 protected:
  static std::string pcd(const std::vector<float>& xyz, char size, const std::string& viewpoint,
                         const std::string& data) {
    const std::string count = std::to_string(xyz.size() / 3);
    const std::string sizes = {size, ' ', size, ' ', size};
    return "VERSION 0.7\nFIELDS x y z\nSIZE " + sizes + "\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
           count + "\nHEIGHT 1\nVIEWPOINT " + viewpoint + "\nPOINTS " + count + "\nDATA " + data;
  }
  /// A room in UTM, as doubles or floats, binary or text.
  std::string utm(bool doubles, bool text, float height = 0.0F) const {
    std::vector<float> xyz = roomPoints(20000);
    for (std::size_t i = 2; i < xyz.size(); i += 3) xyz[i] += height;
    std::string file =
        pcd(xyz, doubles ? '8' : '4', "0 0 0 1 0 0 0", text ? "ascii\n" : "binary\n");
    char number[40];
    for (std::size_t i = 0; i < xyz.size(); ++i) {
      const double value = xyz[i] + (i % 3 == 0 ? kEast : i % 3 == 1 ? kNorth : 0.0);
      const auto narrow = static_cast<float>(value);
      if (text) {
        std::snprintf(number, sizeof number, "%.6f%c", value, i % 3 == 2 ? '\n' : ' ');
        file += number;
      } else if (doubles) {
        file.append(reinterpret_cast<const char*>(&value), sizeof value);
      } else {
        file.append(reinterpret_cast<const char*>(&narrow), sizeof narrow);
      }
    }
    return write("utm.pcd", file);
  }
  Json map() const { return Json::parse(read("out/map.json")); }
  Json metrics() const { return Json::parse(read("out/metrics.json")); }
};

TEST_F(WorldCoordinates, DoublesAreMappedAboutAnOriginThatTheMapKeeps) {
  ASSERT_EQ(0, runOn(room()).exit_code);
  const double planes = metrics()["planes"];
  for (const bool text : {false, true}) {
    const ProgramResult result = expectExit(0, runOn(utm(true, text), {"--force"}));
    EXPECT_EQ(planes, metrics()["planes"]);
    EXPECT_GT(metrics()["standard_cells"], 100);
    EXPECT_EQ(0, metrics()["points"]["beyond"]);
    const Json origin = map()["origin_m"];
    EXPECT_EQ(origin, metrics()["origin_m"]);
    const Json made = map();
    for (const Json& cuboid : made["cuboids"]) {
      EXPECT_NEAR(kEast + 3.0, double{cuboid["center"][0]} + double{origin[0]}, 3.5);
      EXPECT_NEAR(kNorth, double{cuboid["center"][1]} + double{origin[1]}, 3.0);
    }
    const ProgramResult info = planarMap({"info", directory_ / "out/map.pmap"});
    EXPECT_NE(std::string::npos, info.out.find("origin_m")) << info.out;
    // Nobody knows where the sensor was: nothing is said to be seen free.
    EXPECT_NE(std::string::npos, result.err.find("where the sensor stood is not known"));
    const ProgramResult inside =
        planarMap({"query", directory_ / "out/map.pmap", "--box", "1.2,0.2,0.2,1.3,0.3,0.3"});
    EXPECT_NE(std::string::npos, inside.out.find("unknown")) << inside.out;
  }
}

TEST_F(WorldCoordinates, HeightsAboveTheSeaAreNoDepthsOfACamera) {
  ASSERT_EQ(0, runOn(utm(true, false, 8.0F)).exit_code);
  EXPECT_EQ((Json{0.0, 0.0, 1.0}), map()["up"]);
}

TEST_F(WorldCoordinates, FloatsThatCannotHoldTheResolutionAreRefused) {
  for (const char* file : {"single_pcd.yaml", "pcd_sequence.yaml"}) {
    const std::string cloud = utm(false, false);
    const ProgramResult result =
        expectExit(4, planarMap({"run", config(file), "-i", cloud, "-o", directory_ / "out", "-q"}),
                   "where a float knows steps of");
    EXPECT_NE(std::string::npos, result.err.find(cloud)) << result.err;
    EXPECT_NE(std::string::npos, result.err.find("larger resolution (resolution_m)")) << result.err;
    EXPECT_FALSE(exists("out"));
  }
}

TEST_F(WorldCoordinates, PosesInTheWorldAreMappedAboutAnOrigin) {
  std::vector<std::string> arguments = {"run", config("pcd_sequence.yaml"), "-o",
                                        directory_ / "out", "-q"};
  for (int i = 0; i < 3; ++i) {
    std::string viewpoint =
        std::to_string(kEast + 4.0 + 0.1 * i) + " " + std::to_string(kNorth) + " 1 1 0 0 0";
    std::vector<float> xyz = roomPoints(20000, static_cast<std::uint64_t>(i + 1));
    for (std::size_t k = 0; k < xyz.size(); k += 3) {
      xyz[k] -= 0.1f * static_cast<float>(i);  // the room stays where it is
    }
    std::string file = pcd(xyz, '4', viewpoint, "binary\n");
    file.append(reinterpret_cast<const char*>(xyz.data()), xyz.size() * sizeof(float));
    arguments.insert(arguments.end(), {"-i", write(std::to_string(i) + ".pcd", file)});
  }
  expectExit(0, planarMap(arguments));
  EXPECT_EQ((Json{kEast, kNorth, 0.0}), metrics()["origin_m"]);
  EXPECT_GT(metrics()["standard_cells"], 100);
  EXPECT_GT(metrics()["unknown_cells"], 0);
  EXPECT_NE(std::string::npos, read("out/trajectory_tum.txt").find(" 500004.1 4500000 1 "))
      << read("out/trajectory_tum.txt");
  const ProgramResult exported =
      expectExit(0, planarMap({"convert", directory_ / "out/map.pmap", directory_ / "map.obj"}));
  EXPECT_NE(std::string::npos, exported.err.find("add (500000, 4500000, 0) m")) << exported.err;
  // Merged with itself under its own origin, and asked by the cloud it was made of.
  ASSERT_EQ(0, planarMap({"merge", directory_ / "out/map.pmap", "-o", directory_ / "merged.pmap"})
                   .exit_code);
  const ProgramResult same =
      planarMap({"compare", directory_ / "out/map.pmap", directory_ / "merged.pmap"});
  EXPECT_EQ(0, same.exit_code) << same.out << same.err;
  const ProgramResult asked =
      planarMap({"query", directory_ / "merged.pmap", "--points", directory_ / "0.pcd", "--json"});
  EXPECT_GT(Json::parse(asked.out)["cloud"]["occupied"], 19000) << asked.out;
}

TEST_F(WorldCoordinates, TheOriginOfTheSensorGivesTheMapOfItsPose) {
  const Vector3 origin(1.5, -2.25, 0.5);
  std::vector<float> seen = roomPoints(20000);
  for (float& value : seen) value = std::round(1024.0F * value) / 1024.0F;  // sums are exact
  std::vector<float> world = seen;
  for (std::size_t i = 0; i < world.size(); ++i)
    world[i] += static_cast<float>(origin[static_cast<Eigen::Index>(i % 3)]);
  std::string posed = pcd(seen, '4', "1.5 -2.25 0.5 1 0 0 0", "binary\n");
  posed.append(reinterpret_cast<const char*>(seen.data()), seen.size() * sizeof(float));
  expectExit(0, runOn(write("posed.pcd", posed)));
  const Json expected = map()["cuboids"];
  EXPECT_FALSE(expected.empty());
  const std::string cloud = write("world.pcd", binaryPcd(world));
  expectExit(0, runOn(cloud, {"--force", "--origin", "1.5,-2.25,0.5"}));
  EXPECT_EQ(expected, map()["cuboids"]);
  const std::string again = read("out/map.pmap");
  expectExit(0, planarMap({"run", directory_ / "out/config.resolved.yaml", "-o",
                           directory_ / "again", "-q"}));
  EXPECT_EQ(again, read("again/map.pmap"));
  const ProgramResult before =
      planarMap({"query", directory_ / "out/map.pmap", "--point", "2,-2.25,0.5"});
  EXPECT_NE(std::string::npos, before.out.find("free")) << before.out;
}

/// As of OctoMap's scan.dat.
TEST_F(WorldCoordinates, TheSensorMayStandAtTheOrigin) {
  const std::string cloud = write("scan.pcd", binaryPcd(roomPoints(20000)));
  expectExit(0, runOn(cloud, {"--origin", "0,0,0"}));
  const ProgramResult before =
      planarMap({"query", directory_ / "out/map.pmap", "--point", "0.5,0,0"});
  EXPECT_NE(std::string::npos, before.out.find("free")) << before.out;
  const ProgramResult direction =
      runOn(cloud, {"--force", "--set", "planar_cuboid_approximation.up=[0, 0, 0]"});
  EXPECT_EQ(3, direction.exit_code);
  EXPECT_NE(std::string::npos, direction.err.find("not all zero")) << direction.err;
}

TEST_F(WorldCoordinates, AnOriginIsForCloudsWithoutPoses) {
  const std::string poses = write("poses.txt", "0 0 0 0 0 0 0 1\n");
  EXPECT_EQ(2, runOn(room(), {"--origin", "1,2,3", "--poses", poses}).exit_code);
  expectExit(2, runOn(room(), {"--origin", "1,2"}), "must be 3 finite numbers");
}

TEST_F(WorldCoordinates, MapsOfTwoOriginsAreMergedInTheWorld) {
  const auto mapAt = [this](const std::string& name, double east) {
    const std::vector<float> xyz = roomPoints(20000);
    std::string file = pcd(xyz, '4', std::to_string(east) + " 4500000 1 1 0 0 0", "binary\n");
    file.append(reinterpret_cast<const char*>(xyz.data()), xyz.size() * sizeof(float));
    const std::string cloud = write(name + ".pcd", file);
    EXPECT_EQ(0, planarMap({"run", config("pcd_sequence.yaml"), "-i", cloud, "-o",
                            directory_ / name, "-q"})
                     .exit_code);
    return directory_ / name + "/map.pmap";
  };
  const std::string a = mapAt("a", 500000.0);
  const std::string b = mapAt("b", 500600.0);  // its origin is at 501 km
  EXPECT_EQ(4, planarMap({"compare", a, b}).exit_code);
  ASSERT_EQ(0, planarMap({"merge", a, b, "-o", directory_ / "both.pmap"}).exit_code);
  const ProgramResult query =
      planarMap({"query", directory_ / "both.pmap", "--points", directory_ / "b.pcd", "--json"});
  EXPECT_GT(Json::parse(query.out)["cloud"]["occupied"], 19000) << query.out;
  // Poses that put both 4,500 km away give the map an origin there; 2,000 km apart no origin fits.
  const auto merged = [&](const char* poses) {
    return planarMap({"merge", a, b, "-o", directory_ / "placed.pmap", "--force", "--poses",
                      write("poses.txt", poses)});
  };
  expectExit(0, merged("0 4000000 0 0 0 0 0 1\n0 4000000 0 0 0 0 0 1\n"));
  const auto info = [&](const char* map) {
    return Json::parse(planarMap({"info", directory_ / map, "--json"}).out);
  };
  EXPECT_EQ(info("placed.pmap")["planes"], info("both.pmap")["planes"]);
  const ProgramResult apart = merged("0 0 0 0 0 0 0 1\n0 2000000 0 0 0 0 0 1\n");
  EXPECT_NE(0, apart.exit_code);
  EXPECT_NE(std::string::npos, apart.err.find("cells")) << apart.err;
}

TEST_F(WorldCoordinates, PointsBeyondTheMapAreCounted) {
  std::vector<float> xyz = roomPoints(20000);
  xyz.insert(xyz.end(), {3e6f, 0.0f, 0.0f});
  const ProgramResult result = expectExit(0, runOn(write("far.pcd", binaryPcd(xyz))));
  EXPECT_EQ(1, metrics()["points"]["beyond"]);
  EXPECT_NE(std::string::npos, result.err.find("1 points were dropped")) << result.err;
}

// Every row of the table of limits in docs/reliability.md.

struct Row {
  std::string input;
  int exit_code = -1;
  std::string sentence;
};

std::vector<Row> rowsOfTheTable() {
  std::ifstream page(std::string(PLANAR_MAPPING_SOURCE_DIR) + "/docs/reliability.md");
  std::vector<Row> rows;
  bool here = false;
  for (std::string line; std::getline(page, line);) {
    if (line.rfind("## ", 0) == 0) here = line == "## Limits";
    const std::size_t code = line.find("| exit ");
    if (!here || code == std::string::npos) continue;
    Row row;
    row.input = line.substr(2, line.find(" | ", 2) - 2);
    row.exit_code = std::stoi(line.substr(code + 7));
    const std::size_t quote = line.find('"');
    row.sentence = line.substr(quote + 1, line.rfind('"') - quote - 1);
    rows.push_back(row);
  }
  return rows;
}

class Limits : public CliTest {
 protected:
  ProgramResult validated(const std::string& text) const {
    return planarMap({"validate", write("limit.yaml", text)});
  }
  ProgramResult sequence(const std::string& calibration) const {
    write("seq/calib.yaml",
          "image_width: 4\nimage_height: 4\nfx: 4\nfy: 4\ncx: 2\ncy: 2\n" + calibration);
    write("seq/left/0.png", "");
    write("seq/right/0.png", "");
    return planarMap({"run", config("stereo_indoor.yaml"), "-i", directory_ / "seq", "-o",
                      directory_ / "out", "-q"});
  }
  ProgramResult cloud(std::vector<float> xyz, const std::string& what = "",
                      const std::string& by = "") const {
    std::string pcd = binaryPcd(xyz);
    if (!what.empty()) pcd.replace(pcd.find(what), what.size(), by);
    return runOn(write("limit.pcd", pcd));
  }
  /// One point, and a header that says otherwise.
  ProgramResult cloudOfCount(const std::string& count) const {
    const std::string between = "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ";
    return cloud({0, 0, 1}, " 1" + between + "1", " " + count + between + count);
  }
  std::vector<float> roomTimes(float factor, float offset) const {
    std::vector<float> xyz = roomPoints(5000);
    for (float& value : xyz) value = factor * value + offset;
    return xyz;
  }
  ProgramResult query(const std::string& option, const std::string& value) const {
    runOn(room(), {"--force"});
    return planarMap({"query", directory_ / "out/map.pmap", option, value, "--range", "1e9"});
  }
  std::string mapOf(const std::string& name, const std::vector<std::uint8_t>& bytes) const {
    return write(name, std::string(bytes.begin(), bytes.end()));
  }
  /// A header that is right but for the size of what it holds.
  ProgramResult mapFile() const {
    std::string file = std::string("PMAP\5\0\0\0", 8) + std::string("\0\0\0\0\0\1\0\0", 8);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(file.data());
    const std::uint32_t crc = detail::crc32(0, bytes, file.size());
    for (int i = 0; i < 4; ++i) file += static_cast<char>(crc >> (8 * i));
    return planarMap({"info", write("limit.pmap", file)});
  }
};

TEST_F(Limits, AreThoseOfTheDocumentation) {
  const std::string head = "version: 1\nstages:\n  - stage: planar_cuboid_approximation\n";
  const std::multimap<std::string, std::function<ProgramResult()>> beyond = {
      {"configuration, size",
       [&] { return validated(head + "#" + std::string(2 << 20, 'x') + "\n"); }},
      {"configuration, levels",
       [&] { return validated(std::string(40, '[') + std::string(40, ']')); }},
      {"configuration, values",
       [&] {
         std::string list = "inputs: [a";
         for (int i = 0; i < 100001; ++i) list += ",a";
         return validated(head + list + "]\n");
       }},
      {"calib.yaml, size", [&] { return sequence("#" + std::string(2 << 20, 'x') + "\n"); }},
      {"calib.yaml, baseline", [&] { return sequence("baseline_m: 101\n"); }},
      {"poses, line",
       [&] {
         const std::string poses = write("poses.txt", "#" + std::string(5000, 'x') + "\n");
         return runOn(room(), {"--poses", poses});
       }},
      {"cloud, points", [&] { return cloudOfCount("3000000000"); }},
      {"cloud, points", [&] { return cloudOfCount("1000000"); }},
      {"cloud, header line",
       [&] {
         return cloud({0, 0, 1}, "FIELDS", "# " + std::string(70000, 'x') + "\nFIELDS");
       }},
      {"cloud, x y z as floats", [&] { return cloud(roomTimes(1.0f, 4e6f)); }},
      {"cloud, scale", [&] { return cloud(roomTimes(1e-9f, 0.0f)); }},
      {"map, reach",
       [&] {
         std::vector<float> xyz = roomPoints(20000);
         xyz.insert(xyz.end(), {3e6f, 0.0f, 0.0f});
         return cloud(xyz);
       }},
      {"map file, content", [&] { return mapFile(); }},
      {"map, space to resample",
       [&] {
         const std::string poses = write("poses.txt", "0 0 0 0 0 0 0 1\n0 0 0 0 0 0 0.6 0.8\n");
         return planarMap({"merge", mapOf("a.pmap", test::wideMap(27, 2)),
                           mapOf("b.pmap", test::wideMap(27, 2, 1.0)), "--poses", poses, "-o",
                           directory_ / "out.pmap"});
       }},
      {"map, space to list",
       [&] {
         return planarMap(
             {"convert", mapOf("cut.pmap", test::cutMap(200)), directory_ / "out.pgm"});
       }},
      {"query, ray", [&] { return query("--ray", "1e6,0,0,-1,0.001,0"); }},
  };
  const std::vector<Row> rows = rowsOfTheTable();
  EXPECT_EQ(beyond.size(), rows.size());
  std::map<std::string, int> number;
  for (const Row& row : rows) {
    SCOPED_TRACE(row.input + ": " + row.sentence);
    const auto [first, last] = beyond.equal_range(row.input);
    const int place = number[row.input]++;
    if (std::distance(first, last) <= place) {
      ADD_FAILURE() << "is not tested";
      continue;
    }
    std::filesystem::remove_all(directory_ / "out");
    const ProgramResult result = std::next(first, place)->second();
    EXPECT_EQ(row.exit_code, result.exit_code) << result.err;
    EXPECT_NE(std::string::npos, result.err.find(row.sentence)) << result.err;
#ifndef PLANAR_MAPPING_SANITIZED
    EXPECT_LT(result.peak_kilobytes, 500000);
#endif
  }
}

}  // namespace
}  // namespace planar_mapping
