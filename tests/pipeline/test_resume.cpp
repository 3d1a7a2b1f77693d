// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A run that was interrupted and is resumed leaves what an uninterrupted one leaves.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pipeline_frames.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/pipeline/runner.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

namespace fs = std::filesystem;

struct Input {
  const char* configuration;
  const char* scene;
  bool images;
  std::vector<std::string> assignments;
};

void PrintTo(const Input& input, std::ostream* out) {
  *out << input.configuration << " on " << input.scene;
}

class Resume : public ::testing::TestWithParam<Input> {
 protected:
  static constexpr int kFrames = 7;

  void SetUp() override {
    evaluation::SimulationParams params;
    params.scene = GetParam().scene;
    params.frames = kFrames;
    params.step = 0.1;
    params.images = GetParam().images;
    params.width = params.images ? 320 : 160;
    params.height = params.width * 3 / 4;
    params.clouds = !params.images;
    evaluation::writeSequence(evaluation::Simulation(params), directory_ / "input", false);
  }
  static constexpr std::size_t kNever = 1000;
  /// \param stop_after  frames
  /// \param threads     with 1 no frame is in work when the progress of another is told
  RunResult run(const std::string& output, bool resume, std::size_t stop_after,
                bool overwrite = false, int threads = 1) const {
    std::vector<std::string> assignments = GetParam().assignments;
    assignments.push_back("threads=" + std::to_string(threads));
    Configuration configuration = test::readyConfiguration(GetParam().configuration, assignments);
    configuration.inputs = {directory_ / "input"};
    std::atomic<bool> stop{stop_after == 0};
    RunOptions options;
    options.output = directory_ / output;
    options.resume = resume;
    options.overwrite = overwrite;
    options.checkpoint_s = 1e6;  // a slow machine writes nothing to run.log on the way
    options.stop = &stop;
    options.progress = [&](std::size_t done, std::size_t, const FrameReport&) {
      stop = done >= stop_after;
    };
    return runPipeline(std::move(configuration), options);
  }
  std::string read(const std::string& name) const {
    std::ifstream in(directory_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// The lines of a file but for those with a word.
  std::string readWithout(const std::string& word, const std::string& name) const {
    std::istringstream in(read(name));
    std::string text;
    for (std::string line; std::getline(in, line);)
      if (line.find(word) == std::string::npos) text += line + "\n";
    return text;
  }
  /// Without times, and without memory, which depends on how the heap grew.
  nlohmann::json metrics(const std::string& output) const {
    nlohmann::json json = nlohmann::json::parse(read(output + "/metrics.json"));
    json.erase("time_ms");
    json.erase("memory_bytes");
    return json;
  }

  TemporaryDirectory directory_;
};

TEST_P(Resume, EndsAsAnUninterruptedRun) {
  EXPECT_FALSE(run("whole", false, kNever).interrupted);
  EXPECT_TRUE(run("parts", false, 3).interrupted);
  const std::string part = read("parts/map.pmap");
  // As long as it has less than was saved, that stays.
  const RunResult less = run("parts", true, 1);
  EXPECT_TRUE(less.interrupted);
  EXPECT_FALSE(less.saved);
  EXPECT_EQ(part, read("parts/map.pmap"));
  EXPECT_EQ(3, metrics("parts")["frames"]);
  EXPECT_TRUE(run("parts", true, 5).saved);
  EXPECT_EQ(5, metrics("parts")["frames"]);
  EXPECT_FALSE(run("parts", true, kNever).interrupted);
  for (const char* name : {"map.pmap", "map.json", "trajectory_tum.txt", "config.resolved.yaml"})
    EXPECT_EQ(read(std::string("whole/") + name), read(std::string("parts/") + name)) << name;
  EXPECT_EQ(metrics("whole"), metrics("parts"));
  EXPECT_GT(metrics("whole")["cuboids"]["total"], 3);
  EXPECT_EQ(0, metrics("whole")["frames_skipped"]);

  const fs::file_time_type saved = fs::last_write_time(directory_ / "parts/map.pmap");
  const RunResult again = run("parts", true, kNever);
  EXPECT_TRUE(again.was_finished);
  EXPECT_EQ(saved, fs::last_write_time(directory_ / "parts/map.pmap"));
  EXPECT_EQ(read("parts/metrics.json"), again.metrics_json);

  // A map of nothing does not replace one of something, even where that is allowed.
  const RunResult nothing = run("parts", false, 0, true);
  EXPECT_TRUE(nothing.interrupted);
  EXPECT_FALSE(nothing.saved);
  EXPECT_EQ(0, nlohmann::json::parse(nothing.metrics_json)["frames"]);
  EXPECT_EQ(saved, fs::last_write_time(directory_ / "parts/map.pmap"));
  EXPECT_TRUE(run("none", false, 0).saved);
}

/// With threads a frame is integrated while the next one is sensed and another one read.
TEST_P(Resume, ThreadsChangeNothing) {
  run("one", false, kNever);
  for (const int threads : {2, 3}) {
    run("more", false, kNever, true, threads);
    for (const char* name : {"map.pmap", "map.json", "trajectory_tum.txt"})
      EXPECT_EQ(read(std::string("one/") + name), read(std::string("more/") + name)) << name;
    EXPECT_EQ(readWithout("threads", "one/config.resolved.yaml"),
              readWithout("threads", "more/config.resolved.yaml"));
    EXPECT_EQ(readWithout("saved to", "one/run.log"), readWithout("saved to", "more/run.log"));
    nlohmann::json of_more = metrics("more");
    of_more["threads"] = 1;
    EXPECT_EQ(metrics("one"), of_more);
  }
}

/// A frame in work when the signal comes is ended, and saved.
TEST_P(Resume, NoFrameIsLostToASignal) {
  const RunResult stopped = run("parts", false, 3, false, 2);
  EXPECT_TRUE(stopped.interrupted);
  EXPECT_EQ(4, metrics("parts")["frames"]);
  EXPECT_EQ(4u, nlohmann::json::parse(stopped.metrics_json)["frames"]);
}

INSTANTIATE_TEST_SUITE_P(
    ReadyConfigurations, Resume,
    ::testing::Values(
        // Tracks of images, motion by features, ground, beliefs of tracks.
        Input{"stereo_indoor.yaml", "corridor", true, {"motion_estimation.poses=ignore"}},
        Input{"stereo_outdoor.yaml", "outdoor", true, {"motion_estimation.poses=ignore"}},
        // Motion by surfaces, beliefs of cells.
        Input{"pcd_sequence.yaml", "corridor", false, {"motion_estimation.poses=ignore"}},
        Input{"pcd_sequence.yaml", "room", false, {"profile=paper"}}),
    [](const auto& info) { return "Case" + std::to_string(info.index); });

TEST_P(Resume, OfNoRunIsRefused) {
  run("parts", false, 1);
  for (const char* name : {"metrics.json", "config.resolved.yaml"}) {
    fs::rename(directory_ / (std::string("parts/") + name), directory_ / "kept");
    try {
      run("parts", true, kNever);
      FAIL() << "was resumed";
    } catch (const InputError& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find(name)) << error.what();
      EXPECT_NE(std::string::npos, std::string(error.what()).find("--force")) << error.what();
    }
    fs::rename(directory_ / "kept", directory_ / (std::string("parts/") + name));
  }
}

}  // namespace
}  // namespace planar_mapping
