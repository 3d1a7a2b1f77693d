// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A run that ends after each frame and is resumed leaves what an uninterrupted one leaves: all that
// stages remember is in run.state.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

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
  enum class Stop { Never, AfterAFrame, BeforeTheFirst };
  RunResult run(const std::string& output, bool resume, Stop when, bool overwrite = false) const {
    Configuration configuration =
        test::readyConfiguration(GetParam().configuration, GetParam().assignments);
    configuration.inputs = {directory_ / "input"};
    std::atomic<bool> stop{when == Stop::BeforeTheFirst};
    RunOptions options;
    options.output = directory_ / output;
    options.resume = resume;
    options.overwrite = overwrite;
    options.stop = &stop;
    options.progress = [&](std::size_t, std::size_t, const FrameReport&) {
      stop = when == Stop::AfterAFrame;
    };
    return runPipeline(std::move(configuration), options);
  }
  std::string read(const std::string& name) const {
    std::ifstream in(directory_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
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

TEST_P(Resume, AfterEachFrameEndsAsAnUninterruptedRun) {
  EXPECT_FALSE(run("whole", false, Stop::Never).interrupted);
  int runs = 1;
  for (bool interrupted = run("parts", false, Stop::AfterAFrame).interrupted;
       interrupted && runs < 100;) {
    interrupted = run("parts", true, Stop::AfterAFrame).interrupted;
    ++runs;
  }
  EXPECT_EQ(kFrames, runs);
  for (const char* name : {"map.pmap", "map.json", "trajectory_tum.txt", "config.resolved.yaml"})
    EXPECT_EQ(read(std::string("whole/") + name), read(std::string("parts/") + name)) << name;
  EXPECT_EQ(metrics("whole"), metrics("parts"));
  EXPECT_GT(metrics("whole")["cuboids"]["total"], 3);
  EXPECT_EQ(0, metrics("whole")["frames_skipped"]);

  const fs::file_time_type saved = fs::last_write_time(directory_ / "parts/map.pmap");
  const RunResult again = run("parts", true, Stop::Never);
  EXPECT_TRUE(again.was_finished);
  EXPECT_EQ(saved, fs::last_write_time(directory_ / "parts/map.pmap"));
  EXPECT_EQ(read("parts/metrics.json"), again.metrics_json);

  // A map of nothing does not replace one of something, even where that is allowed.
  const RunResult nothing = run("parts", false, Stop::BeforeTheFirst, true);
  EXPECT_TRUE(nothing.interrupted);
  EXPECT_FALSE(nothing.saved);
  EXPECT_EQ(0, nlohmann::json::parse(nothing.metrics_json)["frames"]);
  EXPECT_EQ(saved, fs::last_write_time(directory_ / "parts/map.pmap"));
  EXPECT_TRUE(run("none", false, Stop::BeforeTheFirst).saved);
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

TEST_P(Resume, WithAnotherConfigurationOrChangedFilesIsRefused) {
  run("parts", false, Stop::AfterAFrame);
  const auto expectRefused = [this](const std::string& part) {
    try {
      run("parts", true, Stop::AfterAFrame);
      FAIL() << "was resumed";
    } catch (const InputError& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find(part)) << error.what();
      EXPECT_NE(std::string::npos, std::string(error.what()).find("--force")) << error.what();
    }
  };
  const std::string map = read("parts/map.pmap");
  std::ofstream(directory_ / "parts/map.pmap") << "other";
  expectRefused("map.pmap is not the file that manifest.json speaks of");
  std::ofstream(directory_ / "parts/map.pmap", std::ios::binary) << map;
  fs::remove(directory_ / "parts/run.state");
  expectRefused("run.state");
}

}  // namespace
}  // namespace planar_mapping
