// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "cli_fixture.h"

namespace planar_mapping {
namespace {

using Json = nlohmann::json;

class Interruption : public CliTest {
 protected:
  /// One cloud many times, so that a run takes long enough to be interrupted.
  std::vector<std::string> longRun(const std::string& output, int frames) const {
    const std::string cloud = room();
    std::vector<std::string> arguments = {"run", config("pcd_sequence.yaml")};
    for (int i = 0; i < frames; ++i) arguments.insert(arguments.end(), {"-i", cloud});
    arguments.insert(arguments.end(), {"-o", directory_ / output, "-q", "--progress", "jsonl"});
    return arguments;
  }
  /// Sends the signal once the program has reported a frame.
  static ProgramOptions signalAfterAFrame(int number) {
    ProgramOptions options;
    auto sent = std::make_shared<bool>(false);
    options.while_running = [number, sent](pid_t child, const std::string& err) {
      if (*sent || err.find("\"done\":2") == std::string::npos) return;
      *sent = true;
      ::kill(child, number);
    };
    return options;
  }
};

TEST_F(Interruption, SignalsFinishTheFrameAndSave) {
  for (const int number : {SIGINT, SIGTERM}) {
    const std::string output = "out" + std::to_string(number);
    const ProgramResult result = planarMap(longRun(output, 400), signalAfterAFrame(number));
    EXPECT_EQ(130, result.exit_code) << result.signal << result.err;
    EXPECT_EQ(7u, list(output).size());
    const Json metrics = Json::parse(read(output + "/metrics.json"));
    EXPECT_GE(metrics["frames"], 2);
    EXPECT_LT(metrics["frames"], 400);
    EXPECT_TRUE(metrics["interrupted"]);
    EXPECT_NE(std::string::npos, result.err.find("interrupted; what was done so far is in"));
    EXPECT_EQ(0, planarMap({"info", directory_ / output + "/map.pmap"}).exit_code);
  }
}

TEST_F(Interruption, KilledWhileSavingLeavesTheOldFileOrTheNewOne) {
  const std::string cloud = room();
  ASSERT_EQ(0, runOn(cloud).exit_code);
  const std::string old_map = read("out/map.pmap");
  const std::vector<std::string> other = {"--force", "--set",
                                          "planar_cuboid_approximation.resolution_m=0.2"};
  ASSERT_EQ(0, runOn(cloud, other).exit_code);
  const std::string new_map = read("out/map.pmap");
  ASSERT_TRUE(old_map != new_map);
  const double whole = [&]() { return runOn(cloud, other).seconds; }();

  constexpr int kTries = 60;
  for (int i = 0; i < kTries; ++i) {
    write("out/map.pmap", old_map);
    // Kills are spread over the second half of the run, where it saves.
    const double moment = whole * (0.5 + 0.6 * i / kTries);
    ProgramOptions options;
    const auto start = std::chrono::steady_clock::now();
    options.while_running = [start, moment](pid_t child, const std::string&) {
      const std::chrono::duration<double> now = std::chrono::steady_clock::now() - start;
      if (now.count() > moment) ::kill(child, SIGKILL);
    };
    planarMap({"run", config("single_pcd.yaml"), "-i", cloud, "-o", directory_ / "out", "-q",
               "--force", "--set", "planar_cuboid_approximation.resolution_m=0.1"},
              options);
    const std::string map = read("out/map.pmap");
    EXPECT_TRUE(map == old_map || map == new_map) << "try " << i;
  }
}

TEST_F(Interruption, ResumeContinuesWhereTheRunStopped) {
  const ProgramResult cut = planarMap(longRun("out", 40), signalAfterAFrame(SIGINT));
  ASSERT_EQ(130, cut.exit_code) << cut.err;
  const int done = Json::parse(read("out/metrics.json"))["frames"];
  std::vector<std::string> arguments = longRun("out", 40);
  arguments.push_back("--resume");
  const ProgramResult resumed = planarMap(arguments);
  ASSERT_EQ(0, resumed.exit_code) << resumed.err;
  const Json metrics = Json::parse(read("out/metrics.json"));
  EXPECT_FALSE(metrics["interrupted"]);
  EXPECT_EQ(40, metrics["frames"]);
  const std::string csv = read("out/frames.csv");
  EXPECT_EQ(41, std::count(csv.begin(), csv.end(), '\n'));
  const std::string trajectory = read("out/trajectory_tum.txt");
  EXPECT_EQ(40, std::count(trajectory.begin(), trajectory.end(), '\n') -
                    std::count(trajectory.begin(), trajectory.end(), '#'));
  EXPECT_LT(done, 40);
}

}  // namespace
}  // namespace planar_mapping
