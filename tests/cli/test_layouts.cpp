// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>

#include "cli_fixture.h"

namespace planar_mapping {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

/// Data sets as they are, by the tutorial; what is read of each layout: LayoutFolders of
/// tests/unit/io.
class Layouts : public CliTest {
 protected:
  void simulate(const std::string& name, const std::vector<std::string>& more) const {
    ASSERT_EQ(0, planarMap(joined({"simulate", "corridor", "-o", directory_ / name, "-q", "--step",
                                   "0.2", "--frames", "3"},
                                  more))
                     .exit_code);
  }
  std::vector<std::string> filesIn(const std::string& folder) const {
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path().string());
    std::sort(files.begin(), files.end());
    return files;
  }
};

TEST_F(Layouts, TheTutorialRunsAsItStands) {
  std::ifstream page(std::string(PLANAR_MAPPING_SOURCE_DIR) + "/docs/tutorials/kitti_tum_euroc.md");
  std::string script = "set -e\nexport PATH=" + std::string(PLANAR_MAPPING_BIN_DIR) + ":$PATH\n";
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.compare(0, 3, "```") == 0) {
      inside = line == "```sh";
    } else if (inside) {
      script += line + "\n";
    }
  }
  ProgramOptions options;
  options.directory = directory_.path();
  const ProgramResult result = expectExit(0, runProgram({"/bin/bash", "-c", script}, options));
  for (const char* out : {"out_kitti", "out_tum", "out_euroc", "out_cloud", "out_live"}) {
    const Json metrics = Json::parse(read(std::string(out) + "/metrics.json"));
    EXPECT_GT(metrics["planes"], 0) << out;
    EXPECT_EQ(0, metrics["frames_skipped"]) << out;
  }
  for (const char* sentence :
       {"KITTI odometry (gray): 4 image pairs, poses of a file", "; configuration ",
        "stereo_indoor.yaml", "TUM RGB-D: 4 RGB-D frames, poses of a file",
        "EuRoC (ASL): 4 image pairs, no poses"})
    EXPECT_NE(std::string::npos, result.err.find(sentence)) << result.err;
}

TEST_F(Layouts, AConfigurationThatIsGivenWins) {
  const std::string cloud = room();
  const ProgramResult result = expectExit(
      0, planarMap({"run", cloud, config("pcd_sequence.yaml"), "-o", directory_ / "out"}));
  EXPECT_EQ("", result.err);
  EXPECT_NE(std::string::npos, read("out/run.log").find("pcd_sequence.yaml"));
  EXPECT_NE(std::string::npos, read("out/run.log").find("cloud files: 1 cloud"));
}

TEST_F(Layouts, CloudsWithoutPosesAreRegistered) {
  for (int i = 0; i < 2; ++i)
    write("scans/" + std::to_string(i) + ".pcd", binaryPcd(roomPoints(20000)));
  const ProgramResult result =
      expectExit(0, planarMap({"run", directory_ / "scans", "-o", directory_ / "out"}));
  EXPECT_NE(std::string::npos, result.err.find("motion_estimation.enabled=true")) << result.err;
}

TEST_F(Layouts, RunWithoutAnythingSaysWhatItNeeds) {
  expectExit(2, planarMap({"run", "-o", directory_ / "out"}), "an input or a configuration");
}

/// A recorder that takes its time.
class Watching : public Layouts {
 protected:
  /// Copies the clouds of native/ one by one into recorded/, each written in two halves.
  std::function<void(pid_t, const std::string&)> recorder() {
    return [this](pid_t, const std::string&) {
      using Clock = std::chrono::steady_clock;
      if (Clock::now() < next_) return;
      const std::vector<std::string> files = filesIn(directory_ / "native/clouds");
      if (step_ >= 2 * files.size()) return;
      const fs::path from = files[step_ / 2];
      const std::string bytes = read("native/clouds/" + from.filename().string());
      const std::string to = directory_ / "recorded/" + from.filename().string();
      std::ofstream out(to, std::ios::binary | (step_ % 2 == 0 ? std::ios::trunc : std::ios::app));
      out << (step_ % 2 == 0 ? bytes.substr(0, bytes.size() / 2) : bytes.substr(bytes.size() / 2));
      next_ = Clock::now() + std::chrono::milliseconds(step_ % 2 == 0 ? 100 : 700);
      ++step_;
    };
  }

  std::size_t step_ = 0;
  std::chrono::steady_clock::time_point next_;
};

TEST_F(Watching, MapsWhatARecorderWritesAndEndsWhenItIsIdle) {
  simulate("native", {"--width", "160", "--height", "120"});
  fs::create_directories(directory_ / "recorded");
  const std::vector<std::string> settings = {"-q", "--set", "motion_estimation.enabled=false"};
  const std::string configuration = config("pcd_sequence.yaml");
  ASSERT_EQ(0, planarMap(joined({"run", configuration, "-i", directory_ / "native/clouds", "-o",
                                 directory_ / "batch"},
                                settings))
                   .exit_code);

  bool map_came_early = false;
  const auto record = recorder();
  ProgramOptions options;
  options.while_running = [&](pid_t process, const std::string& err) {
    record(process, err);
    map_came_early = map_came_early || exists("out/map.pmap");
  };
  expectExit(0, planarMap(joined({"run", configuration, "--watch", directory_ / "recorded",
                                  "--idle", "3", "-o", directory_ / "out"},
                                 settings),
                          options));
  EXPECT_TRUE(map_came_early);
  EXPECT_TRUE(read("out/map.pmap") == read("batch/map.pmap"));
}

TEST_F(Watching, EndsAtASignalWithWhatItHas) {
  simulate("native", {"--width", "160", "--height", "120"});
  bool sent = false;
  ProgramOptions options;
  options.while_running = [&](pid_t process, const std::string&) {
    if (sent || !exists("out/map.pmap")) return;
    sent = true;
    ::kill(process, SIGINT);
  };
  expectExit(
      130, planarMap({"run", "--watch", directory_ / "native", "-o", directory_ / "out"}, options));
  EXPECT_GE(Json::parse(read("out/metrics.json"))["frames"], 1);
}

TEST_F(Watching, SaysWhatIsMissing) {
  expectExit(4,
             planarMap({"run", "--watch", directory_ / "nowhere", "--idle", "0.2", "-o",
                        directory_ / "out"}),
             "no such folder to watch");
  fs::create_directories(directory_ / "empty/left");
  expectExit(4,
             planarMap({"run", "--watch", directory_ / "empty", "--idle", "0.2", "-o",
                        directory_ / "out"}),
             "calib.yaml");
}

}  // namespace
}  // namespace planar_mapping
