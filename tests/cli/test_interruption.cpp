// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

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
    EXPECT_NE(std::string::npos, result.err.find("the frame in work is finished"));
    EXPECT_NE(std::string::npos, result.err.find("interrupted; what was done so far is in"));
    EXPECT_EQ(0, planarMap({"info", directory_ / output + "/map.pmap"}).exit_code);
  }
}

TEST_F(Interruption, SecondSignalStopsAtOnceAndLeavesTheEarlierResult) {
  ASSERT_EQ(0, planarMap(longRun("out", 3)).exit_code);
  const std::string before = read("out/map.pmap");
  ProgramOptions options;
  options.while_running = [](pid_t child, const std::string& err) {
    if (err.find("\"done\":2") == std::string::npos) return;
    ::kill(child, SIGINT);
    ::kill(child, SIGTERM);
  };
  const ProgramResult result = planarMap(joined(longRun("out", 400), {"--force"}), options);
  EXPECT_EQ(130, result.exit_code) << result.signal << result.err;
  EXPECT_EQ(before, read("out/map.pmap"));
  // The next run there finds nothing in its way.
  expectExit(0, planarMap(joined(longRun("out", 3), {"--force"})));
  EXPECT_EQ(7u, list("out").size());
}

TEST_F(Interruption, KilledRunIsFinishedByResume) {
  constexpr int kFrames = 40;
  ASSERT_EQ(0, planarMap(longRun("whole", kFrames)).exit_code);
  const std::vector<std::string> arguments = joined(longRun("out", kFrames), {"--checkpoint", "0"});
  const ProgramResult killed = planarMap(arguments, signalAfterAFrame(SIGKILL));
  ASSERT_EQ(SIGKILL, killed.signal);
  const int done = Json::parse(read("out/metrics.json"))["frames"];
  EXPECT_GE(done, 1);
  EXPECT_EQ(0, planarMap({"info", directory_ / "out/map.pmap"}).exit_code);
  const std::vector<std::string> resume = joined(arguments, {"--resume"});
  const ProgramResult resumed = expectExit(0, planarMap(resume));
  EXPECT_EQ(kFrames, std::count(resumed.err.begin(), resumed.err.end(), '{')) << resumed.err;
  for (const char* name : {"map.pmap", "map.json", "trajectory_tum.txt"})
    EXPECT_TRUE(read(std::string("whole/") + name) == read(std::string("out/") + name)) << name;
  const ProgramResult again = expectExit(0, planarMap(resume));
  EXPECT_NE(std::string::npos, again.err.find("is finished; nothing was done")) << again.err;
}

TEST_F(Interruption, ResumedRunKeepsWhatIsSavedUntilItHasAsMuch) {
  ASSERT_EQ(130, planarMap(longRun("out", 400), signalAfterAFrame(SIGINT)).exit_code);
  const int done = Json::parse(read("out/metrics.json"))["frames"];
  ASSERT_GE(done, 2);
  const std::string before = read("out/map.pmap");
  ProgramOptions options;
  options.while_running = [](pid_t child, const std::string& err) {
    if (err.find("\"done\":1") != std::string::npos) ::kill(child, SIGKILL);
  };
  const std::vector<std::string> resume =
      joined(longRun("out", 400), {"--resume", "--checkpoint", "0"});
  EXPECT_EQ(SIGKILL, planarMap(resume, options).signal);
  EXPECT_GE(Json::parse(read("out/metrics.json"))["frames"], done);
  EXPECT_GE(read("out/map.pmap").size(), before.size() / 2);
  expectExit(4, planarMap(joined(resume, {"--set", "depth_error_limit.max_error_m=0.3"})));
}

TEST_F(Interruption, NamesWithNewlinesAreResumed) {
  const std::string first = room("a\nb,\"c\".pcd");
  const std::vector<std::string> arguments = {
      "run", config("pcd_sequence.yaml"), "-i", first,        "-i",    first,          "-i", first,
      "-o",  directory_ / "out",          "-q", "--progress", "jsonl", "--checkpoint", "0"};
  planarMap(arguments, signalAfterAFrame(SIGKILL));
  expectExit(0, planarMap(joined(arguments, {"--resume"})));
  EXPECT_EQ(3, Json::parse(read("out/metrics.json"))["frames"]);
}

TEST_F(Interruption, StandingStillIsNoSignal) {
  // As on a machine with too much other work, or one that was asleep.
  ProgramOptions options;
  auto rests = std::make_shared<int>(2);
  options.while_running = [rests](pid_t child, const std::string& err) {
    if (*rests == 0 || err.find("\"done\":2") == std::string::npos) return;
    --*rests;
    ::kill(child, SIGSTOP);
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    ::kill(child, SIGCONT);
  };
  expectExit(0, planarMap(longRun("out", 20), options));
  EXPECT_EQ(20, Json::parse(read("out/metrics.json"))["frames"]);
  EXPECT_EQ(0, *rests);
}

TEST_F(Interruption, SecondRunInTheSameDirectoryIsRefused) {
  ProgramOptions options;
  ProgramResult second;
  options.while_running = [&](pid_t, const std::string& err) {
    if (second.exit_code != -1 || err.find("\"done\":2") == std::string::npos) return;
    second = planarMap({"run", config("single_pcd.yaml"), "-i", room("other.pcd"), "-o",
                        directory_ / "out", "--force"});
  };
  expectExit(0, planarMap(longRun("out", 40), options));
  EXPECT_EQ(2, second.exit_code);
  expectOneSentence(second, "another run is writing to this directory");
  EXPECT_EQ(40, Json::parse(read("out/metrics.json"))["frames"]);
}

}  // namespace
}  // namespace planar_mapping
