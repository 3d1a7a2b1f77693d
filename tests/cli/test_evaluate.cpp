// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "cli_fixture.h"

namespace planar_mapping {
namespace {

using Json = nlohmann::json;

/// Figures that depend on the machine.
const std::set<std::string> kMachine = {"time_ms_per_frame"};

class Evaluate : public CliTest {
 protected:
  /// A small evaluation of simulated corridors, or of an input.
  ProgramResult evaluate(std::vector<std::string> more = {},
                         const ProgramOptions& options = {}) const {
    std::vector<std::string> arguments = {"evaluate", config("evaluate.yaml"), "--no-figures"};
    const std::vector<std::pair<std::string, std::string>> usual = {{"--scenes", "corridor"},
                                                                    {"--places", "2"},
                                                                    {"--frames-per-place", "2"},
                                                                    {"--cells", "0.3"},
                                                                    {"-o", directory_ / "out"}};
    for (const auto& [option, value] : usual) {
      const bool given = std::find(more.begin(), more.end(), option) != more.end();
      if (!given) arguments.insert(arguments.end(), {option, value});
    }
    return planarMap(joined(arguments, more), options);
  }
  Json results(const std::string& output = "out") const {
    return Json::parse(read(output + "/evaluation.json"));
  }
  std::vector<std::string> inputOptions(const std::string& input) const {
    return {"-i", input, "--set", "ground_removal.enabled=false", "--places", "1"};
  }
  /// Without what depends on the machine.
  static Json figuresOf(Json json) {
    json.erase("threads");
    for (Json& row : json["results"]) {
      for (const std::string& name : kMachine) {
        row.erase(name);
        row["spread"].erase(name);
        row["per_place"].erase(name);
      }
    }
    return json;
  }
};

TEST_F(Evaluate, TablesHoldEveryMethodAndThePromisedColumns) {
  const ProgramResult result = expectExit(0, evaluate());
  EXPECT_EQ((std::vector<std::string>{"evaluation.csv", "evaluation.json", "evaluation.md"}),
            list("out"));
  const Json json = results();
  for (const char* fact :
       {"version", "compiler", "processor", "cores", "octomap", "pcl", "seed", "configuration"}) {
    EXPECT_TRUE(json.contains(fact)) << fact;
  }
  std::set<std::string> methods;
  double octree_file = 0.0;
  for (const Json& row : json["results"]) {
    methods.insert(row["method"]);
    const bool is_ours = row["method"] == "PG" || row["method"] == "PG_paper";
    EXPECT_EQ(0.3, row["cell_m"]);
    EXPECT_EQ(2, row["places"]);
    for (const char* name : {"cells", "combination_efficiency", "error_percent", "completeness",
                             "coverage", "memory_bytes", "file_bytes", "time_ms_per_frame"}) {
      EXPECT_TRUE(row[name].is_number()) << row["method"] << " " << name;
    }
    EXPECT_GT(row["completeness"], 0.5);
    EXPECT_EQ(row["finished_bytes"].is_number(), is_ours) << row["method"];
    EXPECT_EQ(row["ot_bytes"].is_number(), row["method"] == "OG") << row["method"];
    EXPECT_EQ(row["free_not_known"].is_number(), is_ours || row["method"] == "OG");
    EXPECT_LE(row["completeness_quarter"], row["completeness_half"]);
    EXPECT_LE(row["coverage_inside"], row["coverage_quarter"]);
    EXPECT_LT(row["surface_median_m"], 0.4) << row["method"];
    if (row["method"] == "OG") {
      octree_file = row["file_bytes"];
      EXPECT_GT(row["ot_bytes"], octree_file);
    }
    if (row["method"] == "PG" && octree_file > 0.0) {
      EXPECT_LE(row["finished_bytes"].get<double>(), 1.1 * octree_file);  // of some 700 bytes
    }
  }
  EXPECT_EQ(1u, methods.count("SG"));
  EXPECT_EQ(1u, methods.count("RA"));
  EXPECT_EQ(1u, methods.count("PG"));
  EXPECT_EQ(1u, methods.count("PG_paper"));
  EXPECT_EQ(json["results"].size(), methods.size());
  const std::string csv = read("out/evaluation.csv");
  const std::string heading = "scene,cell_m,method,places,cells,";
  EXPECT_NE(std::string::npos, csv.find("\n" + heading));
  EXPECT_EQ(0u, csv.find("# version: planar_mapping "));
  EXPECT_NE(std::string::npos, read("out/evaluation.md").find("### corridor, 2 places"));
  EXPECT_EQ(read("out/evaluation.md"), result.out);
}

TEST_F(Evaluate, FiguresAreTheSameForEveryRunAndNumberOfThreads) {
  ASSERT_EQ(0, evaluate({"-o", directory_ / "a"}).exit_code);
  ASSERT_EQ(0, evaluate({"-o", directory_ / "b", "-j", "2"}).exit_code);
  EXPECT_EQ(figuresOf(results("a")), figuresOf(results("b")));
  EXPECT_NE(std::string::npos, results("b")["threads"].get<std::string>().find("quiet machine"));
}

TEST_F(Evaluate, RecordedCloudsHaveHeldBackPointsAndNoTruth) {
  const std::string cloud = room();
  expectExit(0, evaluate(inputOptions(cloud)));
  const Json all = results();
  for (const Json& row : all["results"]) {
    EXPECT_EQ("room.pcd", row["scene"]);
    EXPECT_TRUE(row["error_percent"].is_null());
    EXPECT_TRUE(row["completeness"].is_null());
    EXPECT_TRUE(row["held_back_median_m"].is_number());
    // The paper's profile covers less (0.895).
    EXPECT_GT(row["coverage"], row["method"] == "PG_paper" ? 0.85 : 0.9) << row["method"];
  }
  EXPECT_NE(std::string::npos, results()["checked_points"].get<std::string>().find("held back"));
}

TEST_F(Evaluate, NothingIsOverwrittenWithoutForce) {
  const std::string cloud = room();
  ASSERT_EQ(0, evaluate(inputOptions(cloud)).exit_code);
  const std::string before = read("out/evaluation.csv");
  const ProgramResult again = expectExit(2, evaluate(inputOptions(cloud)));
  EXPECT_NE(std::string::npos, again.err.find("--force")) << again.err;
  EXPECT_EQ(before, read("out/evaluation.csv"));
  EXPECT_EQ(0, evaluate(joined(inputOptions(cloud), {"--force"})).exit_code);
}

TEST_F(Evaluate, WrongUseIsNamedBeforeAnyWork) {
  struct Case {
    std::vector<std::string> arguments;
    int exit_code;
    std::string says;
  };
  const std::vector<Case> cases = {
      {{"--cells", "0"}, 2, "--cells"},
      {{"--cells", "nan"}, 2, "--cells"},
      {{"--cells", "0.1,x"}, 2, "--cells"},
      {{"--places", "0"}, 2, "--places"},
      {{"--scenes", "moon"}, 2, "there is no scene 'moon'"},
      {{"--variant", "odd"}, 2, "NAME:stage.key=value"},
      {{"--variant", "odd:"}, 2, "changes nothing"},
      {{"--variant", "odd:kl_occupancy.no_such=1"}, 3, "no_such"},
      {{"--set", "kl_occupancy.no_such=1"}, 3, "no_such"},
      {{"-i", "missing.pcd"}, 4, "missing.pcd"},
      {{"-o", "/proc/none"}, 1, "/proc/none"},
  };
  for (const Case& one : cases) {
    const ProgramResult result = evaluate(one.arguments);
    EXPECT_EQ(one.exit_code, result.exit_code) << one.says << ": " << result.err;
    EXPECT_NE(std::string::npos, result.err.find(one.says)) << result.err;
    EXPECT_TRUE(list("out").empty()) << one.says;
    EXPECT_LT(result.seconds, 10.0);
  }
  EXPECT_EQ(3,
            planarMap({"evaluate", directory_ / "none.yaml", "-o", directory_ / "out"}).exit_code);
  EXPECT_EQ(2, planarMap({"evaluate", config("evaluate.yaml")}).exit_code);
}

TEST_F(Evaluate, AFolderThatCannotBeReadIsAnInputError) {
  std::filesystem::create_directories(directory_ / "pairs/left");
  std::filesystem::create_directories(directory_ / "pairs/right");
  write("pairs/calib.yaml", "fx: 500\n");
  expectExit(4, evaluate({"-i", directory_ / "pairs"}));
  EXPECT_FALSE(exists("out/evaluation.json"));
}

TEST_F(Evaluate, InterruptedItSavesWhatWasDone) {
  for (const int number : {SIGINT, SIGTERM}) {
    const std::string output = "out" + std::to_string(number);
    ProgramOptions options;
    auto sent = std::make_shared<bool>(false);
    options.while_running = [number, sent](pid_t child, const std::string& err) {
      if (*sent || err.find("\"done\":2,") == std::string::npos) return;
      *sent = true;
      ::kill(child, number);
    };
    const ProgramResult result = expectExit(
        130, evaluate({"--places", "50", "--progress", "jsonl", "-q", "-o", directory_ / output},
                      options));
    const Json json = results(output);
    EXPECT_TRUE(json["interrupted"]);
    EXPECT_GE(json["results"].size(), 2u);
    EXPECT_LT(json["results"].size(), 5u);
    EXPECT_NE(std::string::npos, result.err.find("interrupted; what was done so far is in"));
  }
}

TEST_F(Evaluate, VariantsGoToATableOfTheirOwn) {
  const std::string cloud = room();
  expectExit(0, evaluate(joined(inputOptions(cloud),
                                {"--variant", "no beliefs:kl_occupancy.enabled=false", "--variant",
                                 "thick:planar_cuboid_approximation.thickness_m=0.6"})));
  std::vector<std::string> methods;
  const Json ablation = Json::parse(read("out/ablation.json"));
  for (const Json& row : ablation["results"]) methods.push_back(row["method"]);
  EXPECT_EQ((std::vector<std::string>{"no beliefs", "thick", "PG"}), methods);
  const Json all = results();
  for (const Json& row : all["results"]) EXPECT_NE("thick", row["method"]);
}

TEST_F(Evaluate, RegimesHoldEveryMethodWithTheSameCells) {
  expectExit(0, evaluate({"--places", "1", "--regimes"}));
  std::map<std::string, Json> rows;
  for (const char* file : {"out/ablation.json", "out/evaluation.json"}) {
    const Json json = Json::parse(read(file));
    for (const Json& row : json["results"]) rows[row["method"]] = row;
  }
  for (const char* raw : {"", "_raw"}) {
    for (const char* cover : {"boxes", "boxes_exact", "planes_exact"})
      ASSERT_EQ(1u, rows.count(std::string(cover) + raw)) << cover << raw;
    const double tolerant = rows[std::string("boxes") + raw]["cells"];
    EXPECT_LT(tolerant, rows[std::string("boxes_exact") + raw]["cells"].get<double>()) << raw;
  }
  // The other methods cover the very cells of our exact boxes.
  for (const char* name : {"SG_filtered", "RA_filtered"}) {
    ASSERT_EQ(1u, rows.count(name));
    for (const char* figure : {"coverage", "completeness", "free_space_violation"}) {
      EXPECT_NEAR(rows["boxes_exact"][figure].get<double>(), rows[name][figure].get<double>(), 2e-3)
          << name << " " << figure;
    }
  }
  // Boxes of the density mode hold all cells, and empty ones.
  EXPECT_GE(rows["RA_density_filtered"]["coverage"], rows["RA_filtered"]["coverage"]);
  EXPECT_GE(rows["RA_density_filtered"]["free_space_violation"],
            rows["RA_filtered"]["free_space_violation"]);
  EXPECT_GT(rows["SG_filtered"]["cells"], rows["RA_density_filtered"]["cells"]);
  EXPECT_GT(rows["SG_filtered"]["cells"], rows["RA_filtered"]["cells"]);
  EXPECT_LE(rows["SG_filtered"]["cells"], rows["SG"]["cells"]);
}

TEST_F(Evaluate, MapsOfPosesThatWereFoundAreJudgedByTheGivenOnes) {
  ASSERT_EQ(0, planarMap({"simulate", "room", "--write", "images", "--width", "320", "--height",
                          "240", "--frames", "4", "--step", "0.05", "-o", directory_ / "scene"})
                   .exit_code);
  expectExit(
      0, planarMap({"evaluate", config("stereo_indoor.yaml"), "-i", directory_ / "scene", "--cells",
                    "0.2", "--frames-per-place", "0", "--set", "motion_estimation.poses=ignore",
                    "--no-figures", "-o", directory_ / "out"}));
  const Json all = results();
  for (const Json& row : all["results"]) {
    EXPECT_EQ(4, row["frames"]);
    EXPECT_GT(row["position_rms_m"], 0.0);
    EXPECT_LT(row["position_rms_m"], 0.05);
    if (row["method"] == "PG_paper") continue;
    EXPECT_GT(row["coverage"], 0.9) << row["method"];
  }
}

TEST_F(Evaluate, EveryIdeaOfTheAblationIsASetOfKnownParameters) {
  expectExit(0, evaluate(joined(inputOptions(room()), {"--ablation"})));
  EXPECT_GE(Json::parse(read("out/ablation.json"))["results"].size(), 6u);
}

TEST_F(Evaluate, AFullDiskLeavesEarlierFilesAsTheyWere) {
  const std::string cloud = room();
  ASSERT_EQ(0, evaluate(inputOptions(cloud)).exit_code);
  const std::string before = read("out/evaluation.json");
  ProgramOptions options;
  options.file_size_limit = 100;
  EXPECT_EQ(1, evaluate(joined(inputOptions(cloud), {"--force"}), options).exit_code);
  EXPECT_EQ(before, read("out/evaluation.json"));
}

TEST_F(Evaluate, FiguresAreDrawnOrTheTablesSayWhyNot) {
  const std::string cloud = room();
  write("none/matplotlib.py", "raise ImportError\n");
  const auto draw = [&](const std::string& output, const std::string& python_path) {
    return runProgram({"/usr/bin/env", "PYTHONPATH=" + python_path, program(), "evaluate",
                       config("evaluate.yaml"), "-i", cloud, "--set",
                       "ground_removal.enabled=false", "--cells", "0.3,0.5", "-q", "-o",
                       directory_ / output});
  };
  const ProgramResult without = expectExit(7, draw("tables", directory_ / "none"));
  EXPECT_NE(std::string::npos, without.err.find("install python3-matplotlib")) << without.err;
  EXPECT_EQ((std::vector<std::string>{"evaluation.csv", "evaluation.json", "evaluation.md"}),
            list("tables"));
  const ProgramResult result = draw("out", "");
  if (result.exit_code == 7) GTEST_SKIP() << result.err;
  ASSERT_EQ(0, result.exit_code) << result.err;
  for (const char* name :
       {"fig12_combination_efficiency", "fig14_memory_file_time", "cells_at_equal_error"})
    EXPECT_EQ(0u, read("out/" + std::string(name) + ".png").find("\x89PNG")) << name;
  EXPECT_FALSE(exists("out/fig13_mapping_error.png")) << "there is no truth to draw";
  const std::string charts = std::string(PLANAR_MAPPING_BIN_DIR) + "/planar_map_charts";
  const std::vector<std::string> page = {charts, "--equal-error", directory_ / "both.png",
                                         directory_ / "out", directory_ / "tables"};
  expectExit(0, runProgram(page));
  EXPECT_NE(std::string::npos, expectExit(2, runProgram(page)).err.find("--force"));
  EXPECT_EQ(4, runProgram({charts, directory_ / "none"}).exit_code);
}

}  // namespace
}  // namespace planar_mapping
