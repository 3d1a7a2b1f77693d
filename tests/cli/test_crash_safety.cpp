// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A run that dies or meets a failing disk at any operation on its files, then --resume: the bytes
// of an uninterrupted run, or a refusal with its reason and the earlier result whole.
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "cli_fixture.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

/// Every operation is tried where PLANAR_MAPPING_ALL_FAULTS is set, else every few.
int strideOf(int usual) {
  return std::getenv("PLANAR_MAPPING_ALL_FAULTS") != nullptr ? 1 : usual;
}

class CrashSafety : public CliTest, public ::testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    for (int i = 0; i < kFrames; ++i) {
      write("input/" + std::to_string(i) + ".pcd",
            binaryPcd(roomPoints(1500, static_cast<std::uint64_t>(i + 1))));
    }
    ASSERT_EQ(0, run("whole", {}).exit_code);
  }
  ProgramResult run(const std::string& output, const std::vector<std::string>& more,
                    int fault_at = 0, const char* kind = GetParam()) const {
    std::vector<std::string> arguments =
        joined({program(), "run", config("pcd_sequence.yaml"), "-i", directory_ / "input", "-o",
                directory_ / output, "-q"},
               more);
    if (fault_at > 0) {
      const std::vector<std::string> shim = {"/usr/bin/env",
                                             std::string("LD_PRELOAD=") + FAULT_SHIM,
                                             "FAULT_DIRECTORY=" + directory_ / output,
                                             "FAULT_MARK=" + directory_ / "mark",
                                             std::string("FAULT_KIND=") + kind,
                                             "FAULT_AT=" + std::to_string(fault_at)};
      arguments.insert(arguments.begin(), shim.begin(), shim.end());
    }
    return runProgram(arguments);
  }
  /// Without times, and without memory, which depends on how the heap grew.
  nlohmann::json metrics(const std::string& output) const {
    nlohmann::json json = nlohmann::json::parse(read(output + "/metrics.json"), nullptr, false);
    if (!json.is_object()) return json;
    json.erase("time_ms");
    json.erase("memory_bytes");
    return json;
  }
  void expectSame(const std::string& expected, const std::string& output) const {
    for (const char* name : {"/map.pmap", "/map.json", "/trajectory_tum.txt"})
      EXPECT_TRUE(read(expected + name) == read(output + name)) << name;
    EXPECT_EQ(metrics(expected), metrics(output));
    const std::string all = read(expected + "/frames.csv"), rows = read(output + "/frames.csv");
    EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), std::count(rows.begin(), rows.end(), '\n'));
  }
  void expectNothingLeft(const std::string& output) const {
    for (const std::string& name : list(output)) EXPECT_NE('.', name.front()) << name;
  }
  /// Runs with a fault at one operation after the other, each time in a copy of `start`, if there
  /// is one; `check` looks at what is left. \return how many operations there are
  template <typename Check>
  int forEachFault(const std::string& start, const std::vector<std::string>& more, int stride,
                   const Check& check) const {
    for (int at = 1;; at += strideOf(stride)) {
      fs::remove_all(directory_ / "out");
      if (!start.empty()) fs::copy(directory_ / start, directory_ / "out");
      fs::remove(directory_ / "mark");
      const ProgramResult result = run("out", more, at);
      SCOPED_TRACE("operation " + std::to_string(at) + ", " + result.err);
      if (!exists("mark")) {
        RecordProperty("operations", at - 1);  // for --gtest_output
        return at;
      }
      if (std::string(GetParam()) == "kill") {
        EXPECT_EQ(SIGKILL, result.signal);
      } else if (result.exit_code != 0 && result.exit_code != 5) {
        EXPECT_EQ(1, result.exit_code);
        EXPECT_NE(std::string::npos, result.err.find(directory_ / "out")) << "which file?";
      }
      check(result);
      if (::testing::Test::HasFailure()) return at;
    }
  }
  void expectResumes() const {
    expectExit(0, run("out", {"--resume"}));
    expectSame("whole", "out");
    expectNothingLeft("out");
  }

  static constexpr int kFrames = 3;
};

TEST_P(CrashSafety, FirstSave) {
  const int operations = forEachFault("", {}, 3, [this](const ProgramResult&) { expectResumes(); });
  EXPECT_GT(operations, 40);
}

TEST_P(CrashSafety, Checkpoints) {
  const int operations = forEachFault("", {"--checkpoint", "0"}, 11,
                                      [this](const ProgramResult&) { expectResumes(); });
  EXPECT_GT(operations, 120);
}

TEST_P(CrashSafety, ResumeOfAnInterruptedRun) {
  // Killed in the middle of its second checkpoint.
  const ProgramResult killed = run("half", {"--checkpoint", "0"}, 75, "kill");
  ASSERT_EQ(SIGKILL, killed.signal);
  ASSERT_GE(metrics("half")["frames"], 1);
  ASSERT_LT(metrics("half")["frames"], kFrames);
  const int operations = forEachFault("half", {"--resume", "--checkpoint", "0"}, 11,
                                      [this](const ProgramResult&) { expectResumes(); });
  EXPECT_GT(operations, 80);
}

TEST_P(CrashSafety, OverwritingLeavesTheOldResultOrTheNewOne) {
  const std::vector<std::string> other = {"--set", "planar_cuboid_approximation.resolution_m=0.23"};
  ASSERT_EQ(0, run("old", other).exit_code);
  const int operations = forEachFault("old", {"--force"}, 3, [&](const ProgramResult&) {
    const ProgramResult resumed = run("out", {"--resume"});
    if (resumed.exit_code == 0) {
      expectSame("whole", "out");
    } else {
      EXPECT_EQ(4, resumed.exit_code);
      EXPECT_NE(std::string::npos, resumed.err.find("it was made with another configuration"));
      expectSame("old", "out");
      EXPECT_EQ(0, run("out", joined(other, {"--resume"})).exit_code);
    }
    expectNothingLeft("out");
  });
  EXPECT_GT(operations, 40);
}

INSTANTIATE_TEST_SUITE_P(Faults, CrashSafety, ::testing::Values("kill", "eio", "full"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace planar_mapping
