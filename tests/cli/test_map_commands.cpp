// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// query, convert, merge, compare: what scripts ask of a map.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "cli_fixture.h"

namespace planar_mapping {
namespace {

using Json = nlohmann::json;

class MapCommands : public CliTest {
 protected:
  /// A floor at z = -0.5, walls at x = 5 and y = 1.5, a box at x = 2.5 (cli_fixture.h).
  std::string map(std::uint64_t seed = 1) {
    const std::string name = "out" + std::to_string(seed);
    const ProgramResult result =
        expectExit(0, planarMap({"run", config("single_pcd.yaml"), "-i", room(name + ".pcd", seed),
                                 "-o", directory_ / name, "-q", "--set",
                                 "planar_cuboid_approximation.resolution_m=0.1"}));
    return directory_ / (name + "/map.pmap");
  }
};

TEST_F(MapCommands, QueryTellsStatesOfPointsBoxesAndRays) {
  const std::string file = map();
  const ProgramResult result =
      expectExit(0, planarMap({"query", file, "--point", "5,0,0.5", "--point", "3.5,-0.5,0.7",
                               "--box", "4.8,-1,0,5.2,1,1", "--ray", "3,-0.5,0.6,1,0,0", "--ray",
                               "3,-0.5,0.6,0,0,5", "--json"}));
  const Json answers = Json::parse(result.out);
  EXPECT_EQ(answers["point"][0]["state"], "occupied");
  EXPECT_GT(answers["point"][0]["probability"], 0.5);
  EXPECT_EQ(answers["point"][0]["planes"].size(), 1u);
  EXPECT_EQ(answers["point"][1]["state"], "free");
  EXPECT_EQ(answers["point"][1]["probability"], 0.0);
  EXPECT_EQ(answers["box"][0]["state"], "occupied");
  EXPECT_FALSE(answers["box"][0]["cuboids"].empty());
  EXPECT_EQ(answers["ray"][0]["state"], "occupied");
  EXPECT_NEAR(answers["ray"][0]["distance_m"].get<double>(), 2.0, 0.1);
  EXPECT_NEAR(answers["ray"][0]["point"][0].get<double>(), 5.0, 0.1);
  // No frame has seen what lies there.
  EXPECT_EQ(answers["ray"][1]["state"], "unknown");
  EXPECT_TRUE(answers["ray"][1].contains("distance_m"));
  const std::vector<std::string> through = {"query", file, "--through-unknown", "--json", "--ray"};
  const auto passed = [&](const std::string& ray, const std::string& range) {
    std::vector<std::string> arguments = through;
    arguments.insert(arguments.end(), {ray, "--range", range});
    return Json::parse(expectExit(0, planarMap(arguments)).out)["ray"][0];
  };
  EXPECT_EQ(passed("3,-0.5,0.6,0,0,5", "9")["state"], "unknown");  // nothing met is not all free
  EXPECT_FALSE(passed("3,-0.5,0.6,0,0,5", "9").contains("distance_m"));
  EXPECT_EQ(passed("3,-0.5,0.6,1,0,0", "1")["state"], "free");
}

TEST_F(MapCommands, QueryTakesNegativeNumbersAndAnswersInLines) {
  const ProgramResult result = expectExit(0, planarMap({"query", map(), "--point", "-3, -3, -3"}));
  EXPECT_EQ(result.out, "point -3, -3, -3: unknown, probability 0.5\n");
}

/// The corridor of scripts/demo.sh, the first frame of it as a cloud. Snapshots draw this plan.
TEST_F(MapCommands, WhatNoFrameSawIsUnknownInAnswersAndPlans) {
  const std::string scene = directory_ / "scene", plan = directory_ / "plan.pgm";
  expectExit(0, planarMap({"simulate", "corridor", "--frames", "1", "--yaw-deg", "20", "-o", scene,
                           "-q"}));
  expectExit(0, planarMap({"run", config("pcd_sequence.yaml"), "-i", scene, "-o",
                           directory_ / "out", "-q"}));
  const std::string file = directory_ / "out/map.pmap";
  expectExit(0, planarMap({"convert", file, plan, "--robot-height", "0.5"}));
  const std::string yaml = read("plan.yaml"), pgm = read("plan.pgm");
  double x0 = 0.0, y0 = 0.0;
  ASSERT_EQ(2, std::sscanf(yaml.c_str() + yaml.find("origin: ["), "origin: [%lf, %lf", &x0, &y0));
  int width = 0, height = 0;
  ASSERT_EQ(2, std::sscanf(pgm.c_str() + pgm.find("m/pix\n"), "m/pix %d %d", &width, &height));
  const auto at = [&](double x, double y) -> int {
    const int from_end = (1 + static_cast<int>((y - y0) / 0.1)) * width;
    const int column = static_cast<int>((x - x0) / 0.1);
    if (from_end > width * height || column >= width) return 205;  // beyond the plan
    return static_cast<unsigned char>(
        pgm.at(pgm.size() - static_cast<std::size_t>(from_end - column)));
  };
  EXPECT_EQ(254, at(3.0, 0.8));   // before the camera
  EXPECT_EQ(205, at(1.8, 3.84));  // behind a wall
  EXPECT_EQ(205, at(3.0, -0.3));
  for (const std::string place : {"1000,1000,1", "-1,-0.5,0.4", "1.8,3.84,1", "0.2,0.1,3"}) {
    EXPECT_NE(std::string::npos,
              planarMap({"query", file, "--point", place}).out.find(": unknown, probability 0.5"))
        << place;
  }
}

TEST_F(MapCommands, QueryAnswersForEachPointOfACloud) {
  const std::string file = map();
  const std::string cloud = write("ask.pcd", asciiPcd({"5 0 0.5", "3.5 -0.5 0.7", "nan 0 0"}));
  const ProgramResult lines = expectExit(0, planarMap({"query", file, "--points", cloud}));
  EXPECT_EQ(lines.out.rfind("x,y,z,state,probability\n5,0,0.5,occupied,", 0), 0u) << lines.out;
  EXPECT_NE(lines.out.find("\n3.5,-0.5,0.7,free,0\n"), std::string::npos) << lines.out;
  const ProgramResult counts = planarMap({"query", file, "--points", cloud, "--json"});
  const Json expected = {{"free", 1}, {"occupied", 1}, {"unknown", 0}};
  EXPECT_EQ(Json::parse(counts.out)["cloud"], expected);
}

TEST_F(MapCommands, QueryRefusesWhatIsNoQuestion) {
  const std::string file = map();
  for (const std::vector<std::string>& question : {std::vector<std::string>{},
                                                   {"--point", "1,2"},
                                                   {"--point", "1,2,x"},
                                                   {"--point", "nan,0,0"},
                                                   {"--box", "0,0,0,inf,1,1"},
                                                   {"--box", "1,1,1,0,0,0"},
                                                   {"--ray", "0,0,0,0,0,0"},
                                                   {"--point", "1,2,3", "--box", "1,1,1,0,0,0"},
                                                   {"--ray", "0,0,0,1,0,0", "--range", "-1"}}) {
    const ProgramResult result = expectExit(2, planarMap(joined({"query", file}, question)));
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err, "");
  }
  EXPECT_EQ(planarMap({"query", directory_ / "none.pmap", "--point", "1,2,3"}).exit_code, 4);
}

TEST_F(MapCommands, ConvertWritesByExtensionAndNeverOverUnasked) {
  const std::string file = map();
  for (const char* name :
       {"c.pmap", "c.json", "c.csv", "c.sdf", "c/", "c.urdf", "c.scene", "c.pgm", "c.html", "c.bt",
        "c.ot", "c.vtp", "c.glb", "c.ply", "c.obj", "c.stl", "c.pcd"}) {
    EXPECT_EQ(planarMap({"convert", file, directory_ / name}).exit_code, 0) << name;
    const std::string written = name == std::string("c/") ? "c/model.sdf" : name;
    EXPECT_GT(read(written).size(), 100u) << name;
    const ProgramResult again = planarMap({"convert", file, directory_ / name});
    EXPECT_EQ(again.exit_code, 2) << name;
    EXPECT_NE(again.err.find(written), std::string::npos) << again.err;
    EXPECT_EQ(planarMap({"convert", file, directory_ / name, "--force"}).exit_code, 0) << name;
  }
  for (const char* beside : {"c.yaml", "c.mtl", "c/model.config"}) EXPECT_TRUE(exists(beside));
  EXPECT_EQ(read("c.pmap"), read("out1/map.pmap"));
  EXPECT_EQ(read("c.json"), read("out1/map.json"));
  const ProgramResult unheard =
      expectExit(2, planarMap({"convert", file, directory_ / "map.docx"}));
  EXPECT_NE(unheard.err.find(".ply"), std::string::npos) << unheard.err;
}

TEST_F(MapCommands, ConvertHelpSaysWhoReadsWhat) {
  const ProgramResult help = expectExit(0, planarMap({"convert", "--help"}));
  for (const char* line : {".scene  collision objects: MoveIt", ".pgm    plan with its .yaml",
                           "ParaView", "--robot-height"}) {
    EXPECT_NE(help.out.find(line), std::string::npos) << line << help.out;
  }
}

TEST_F(MapCommands, ConvertTakesItsOptions) {
  const std::string file = map();
  ASSERT_EQ(planarMap({"convert", file, directory_ / "m.pgm", "--cell", "0.5", "--robot-height",
                       "0.7", "--frame-id", "odom"})
                .exit_code,
            0);
  EXPECT_NE(read("m.yaml").find("robot 0.7 m high"), std::string::npos);
  EXPECT_NE(read("m.yaml").find("resolution: 0.5\n"), std::string::npos);
  ASSERT_EQ(planarMap({"convert", file, directory_ / "c.pcd"}).exit_code, 0);
  ASSERT_EQ(
      planarMap({"convert", file, directory_ / "s.pcd", "--surface", "--spacing", "0.1"}).exit_code,
      0);
  EXPECT_GT(read("s.pcd").size(), 2 * read("c.pcd").size());
  expectExit(0, planarMap({"convert", file, directory_ / "c.ply", "--cell", "0.5"}),
             "--cell is ignored");
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{"--robot-height", "0"},
                                                {"--max-slope", "90"},
                                                {"--cell", "-1"},
                                                {"--cell", "nan"},
                                                {"--cell", "0"},
                                                {"--spacing", "0"},
                                                {"--frame-id", "a b"}}) {
    EXPECT_EQ(planarMap(joined({"convert", file, directory_ / "x.pgm"}, wrong)).exit_code, 2)
        << wrong[0] << wrong[1];
    EXPECT_FALSE(exists("x.pgm"));
  }
}

TEST_F(MapCommands, ConvertIntoTooFineAnOctreeFailsInBoundedMemory) {
  const ProgramResult result =
      expectExit(2, planarMap({"convert", map(), directory_ / "m.bt", "--cell", "0.001"}));
  EXPECT_NE(result.err.find("--cell 0.002"), std::string::npos) << result.err;
  EXPECT_LT(result.peak_kilobytes, 1'500'000);
  EXPECT_FALSE(exists("m.bt"));
}

TEST_F(MapCommands, ConvertOntoAFullDiskLeavesNothing) {
  const std::string file = map();
  for (const char* name : {"m.csv", "m.sdf", "m/", "m.urdf", "m.scene", "m.pgm", "m.bt", "m.ot",
                           "m.html", "m.vtp", "m.glb", "m.ply", "m.obj", "m.stl", "m.pcd"}) {
#ifdef PLANAR_MAPPING_SANITIZED
    // Where it is not inlined, the packaged OctoMap's own code says on stderr what it writes.
    if (name == std::string("m.bt")) continue;
#endif
    ProgramOptions options;
    options.file_size_limit = 64;
    const ProgramResult result = planarMap({"convert", file, directory_ / name}, options);
    EXPECT_EQ(result.exit_code, 1) << name << result.err;
    expectOneSentence(result, "m");
    for (const std::string& left : list(name == std::string("m/") ? "m" : ".")) {
      EXPECT_NE(left.rfind("m.", 0), 0u) << name << ": " << left;
      EXPECT_EQ(left.find(".tmp"), std::string::npos) << left;
    }
  }
}

TEST_F(MapCommands, FinishedMapsAreReadWhereverMapsAre) {
  const std::string file = map();
  const std::string finished = directory_ / "finished.pmap";
  ASSERT_EQ(planarMap({"convert", file, finished, "--finished"}).exit_code, 0);
  EXPECT_LT(read("finished.pmap").size(), read("out1/map.pmap").size());
  const ProgramResult info = expectExit(0, planarMap({"info", finished, "--json"}));
  const Json facts = Json::parse(info.out),
             all = Json::parse(planarMap({"info", file, "--json"}).out);
  EXPECT_EQ(facts["type"], "finished map");
  EXPECT_EQ(facts["cuboids"], all["cuboids"]);
  EXPECT_EQ(facts["unknown_cells"], all["unknown_cells"]);
  EXPECT_EQ(facts["bounds_m"], all["bounds_m"]);
  EXPECT_FALSE(facts.contains("planes"));
  const std::vector<std::string> question = {"--ray", "3,-0.5,0.6,1,0,0", "--json"};
  const auto ask = [&](const std::string& of) {
    const ProgramResult result =
        expectExit(0, planarMap({"query", of, question[0], question[1], question[2]}));
    return Json::parse(result.out)["ray"][0];
  };
  EXPECT_EQ(ask(finished), ask(file));
  EXPECT_EQ(planarMap({"compare", file, finished}).exit_code, 0);
  EXPECT_EQ(planarMap({"convert", finished, directory_ / "again.pmap"}).exit_code, 0);
  EXPECT_EQ(read("again.pmap"), read("finished.pmap"));
  EXPECT_EQ(planarMap({"convert", finished, directory_ / "map.sdf", "--unknown"}).exit_code, 0);
}

/// What examples/read_map.py says of a map: a line for each fact, then one for each cuboid.
TEST_F(MapCommands, MapsAreReadByAProgramInPython) {
  const std::string python = PLANAR_MAPPING_PYTHON;
  if (python.empty()) GTEST_SKIP() << "no python3 with numpy and zstandard";
  const std::string file = map();
  const std::string finished = directory_ / "finished.pmap";
  ASSERT_EQ(planarMap({"convert", file, finished, "--finished"}).exit_code, 0);
  const Json all = Json::parse(read("out1/map.json"));
  for (const std::string& path : {file, finished}) {
    const ProgramResult result = expectExit(
        0, runProgram(
               {python, std::string(PLANAR_MAPPING_SOURCE_DIR) + "/examples/read_map.py", path}));
    const Json info = Json::parse(planarMap({"info", path, "--json"}).out);
    const bool is_finished = info["type"] == "finished map";
    std::istringstream lines(result.out);
    std::string line;
    std::map<std::string, std::size_t> facts;
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_EQ(line.rfind(is_finished ? "finished map" : "full map", 0), 0u) << line;
    while (facts.count("cuboids") == 0 && std::getline(lines, line))
      facts[line.substr(0, line.rfind(' '))] = std::stoul(line.substr(line.rfind(' ') + 1));
    EXPECT_EQ(facts["cuboids"], info["cuboids"]["total"]);
    EXPECT_GE(facts["unknown cells"], info["unknown_cells"]);  // those in cuboids as well
    EXPECT_GT(facts["free cells"], 1000u);
    if (!is_finished) {
      EXPECT_EQ(facts["planes"], info["planes"]);
      EXPECT_EQ(facts["frames"], info["frames"]);
      EXPECT_GT(facts["plane cells"], 100u);
    }
    for (const Json& cuboid : all["cuboids"]) {
      if (cuboid["state"] != "occupied") continue;
      ASSERT_TRUE(std::getline(lines, line));
      std::istringstream numbers(line);
      const auto expectNext = [&](const Json& wanted) {
        double number = 0.0;
        ASSERT_TRUE(numbers >> number) << line;
        EXPECT_NEAR(number, wanted, 1e-6 * (1.0 + std::abs(wanted.get<double>()))) << line;
      };
      for (const char* part : {"center", "size", "quaternion_xyzw"}) {
        for (const Json& number : cuboid[part]) expectNext(number);
      }
      expectNext(cuboid["plane_id"]);
      expectNext(is_finished ? Json(1.0) : cuboid["probability"]);
    }
    EXPECT_FALSE(std::getline(lines, line)) << line;
  }
}

TEST_F(MapCommands, TheProgramInPythonSaysWhatIsWrongWithAFile) {
  const std::string python = PLANAR_MAPPING_PYTHON;
  if (python.empty()) GTEST_SKIP() << "no python3 with numpy and zstandard";
  map();
  const std::string bytes = read("out1/map.pmap");
  const std::pair<std::string, std::string> cases[] = {
      {write("empty.pmap", ""), "no planar map"},
      {write("text.pmap", "garbage\n"), "no planar map"},
      {write("cut.pmap", bytes.substr(0, bytes.size() / 2)), "damaged"},
      {directory_ / "none.pmap", "No such file"},
      {directory_.path(), "Is a directory"}};
  for (const auto& [path, reason] : cases) {
    const ProgramResult result = runProgram(
        {python, std::string(PLANAR_MAPPING_SOURCE_DIR) + "/examples/read_map.py", path});
    EXPECT_EQ(1, result.exit_code) << path;
    EXPECT_EQ(0u, result.err.find(path + ": ")) << result.err;
    EXPECT_NE(std::string::npos, result.err.find(reason)) << result.err;
    EXPECT_EQ(std::string::npos, result.err.find("Traceback")) << result.err;
  }
}

TEST_F(MapCommands, FinishedMapsAreRefusedWhereTheyHaveTooLittle) {
  const std::string file = map();
  const std::string finished = directory_ / "finished.pmap";
  ASSERT_EQ(planarMap({"convert", file, finished, "--finished"}).exit_code, 0);
  const std::string out = directory_ / "none.pmap";
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"merge", finished, file, "-o", out},
        {"merge", file, finished, "-o", out}}) {
    const ProgramResult result = expectExit(4, planarMap(arguments));
    EXPECT_NE(result.err.find("finished"), std::string::npos) << result.err;
    EXPECT_FALSE(exists("none.pmap"));
  }
}

TEST_F(MapCommands, MergeMakesOneMapOfSeveral) {
  const std::string first = map(1), second = map(2);
  const std::string merged = directory_ / "merged.pmap";
  expectExit(0, planarMap({"merge", first, second, "-o", merged}));
  const Json info = Json::parse(planarMap({"info", merged, "--json"}).out);
  EXPECT_EQ(info["frames"], 2);
  // The same room twice: nothing is there twice.
  const Json one = Json::parse(planarMap({"info", first, "--json"}).out);
  EXPECT_EQ(info["planes"], one["planes"]);
  EXPECT_EQ(planarMap({"compare", first, merged, "--threshold", "0.2"}).exit_code, 0);
  EXPECT_EQ(planarMap({"merge", first, second, "-o", merged}).exit_code, 2);
  expectExit(2, planarMap({"merge", first, second, "-o", directory_ / "m.txt"}), "*.pmap");
  EXPECT_EQ(planarMap({"merge", first, second, "-o", merged, "--force"}).exit_code, 0);
}

TEST_F(MapCommands, MergeDoesNotDependOnTheOrderOfFiles) {
  const std::string first = map(1), second = map(2), third = map(3);
  const std::string poses = write("ab.txt", "0 0 0 0 0 0 0 1\n0 20 0 0 0 0 0 1\n");
  const std::string other_poses = write("ba.txt", "0 20 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n");
  const auto merged = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "merge");
    arguments.insert(arguments.end(), {"-o", directory_ / "merged.pmap", "--force"});
    expectExit(0, planarMap(arguments));
    return read("merged.pmap");
  };
  const std::string expected = merged({first, second, third});
  EXPECT_EQ(merged({third, first, second}), expected);
  EXPECT_EQ(merged({second, first, third}), expected);
  EXPECT_EQ(merged({first, second, "--poses", poses}),
            merged({second, first, "--poses", other_poses}));
  EXPECT_EQ(merged({first, first, first}), read("out1/map.pmap"));
}

TEST_F(MapCommands, MergePlacesMapsByTheirPoses) {
  const std::string first = map(1);
  const std::string poses = write("poses.txt", "0 0 0 0 0 0 0 1\n0 20 0 0 0 0 0 1\n");
  const std::string merged = directory_ / "merged.pmap";
  expectExit(0, planarMap({"merge", first, first, "-o", merged, "--poses", poses}));
  const Json answers = Json::parse(
      planarMap({"query", merged, "--point", "5,0,0.5", "--point", "25,0,0.5", "--json"}).out);
  EXPECT_EQ(answers["point"][0]["state"], "occupied");
  EXPECT_EQ(answers["point"][1]["state"], "occupied");
  const std::string short_file = write("one.txt", "0 0 0 0 0 0 0 1\n");
  EXPECT_EQ(
      planarMap({"merge", first, first, "-o", merged, "--force", "--poses", short_file}).exit_code,
      4);
}

TEST_F(MapCommands, CompareExitsBySixOverItsThreshold) {
  const std::string first = map(1), second = map(2);
  const ProgramResult same = expectExit(0, planarMap({"compare", first, first}));
  EXPECT_NE(same.out.find("difference: 0\n"), std::string::npos) << same.out;
  const ProgramResult other = expectExit(6, planarMap({"compare", first, second, "--json"}));
  const Json answer = Json::parse(other.out);
  const double difference = answer["difference"];
  EXPECT_GT(difference, 0.0);
  EXPECT_LT(difference, 0.5);
  EXPECT_NEAR(difference,
              (answer["only_in_first"].get<double>() + answer["only_in_second"].get<double>()) /
                  (answer["only_in_first"].get<double>() + answer["only_in_second"].get<double>() +
                   answer["in_both"].get<double>()),
              1e-12);
  EXPECT_EQ(planarMap({"compare", first, second, "--threshold", "0.5"}).exit_code, 0);
  for (const char* wrong : {"2", "nan", "-nan"})
    EXPECT_EQ(planarMap({"compare", first, second, "--threshold", wrong}).exit_code, 2) << wrong;
  EXPECT_EQ(planarMap({"compare", first, room()}).exit_code, 4);
}

}  // namespace
}  // namespace planar_mapping
