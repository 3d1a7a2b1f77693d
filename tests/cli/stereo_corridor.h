// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "cli_fixture.h"
#include "evaluation/simulation/simulation.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/io/pose_file.h"

namespace planar_mapping {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct Pair {
  io::Image left;
  io::Image right;
  Pose T_world_camera = Pose::Identity();
};

/// A simulated corridor, 10 cm from frame to frame. Frames are made once for all tests.
inline const Pair& corridorPair(std::size_t index) {
  static const evaluation::Simulation simulation = []() {
    evaluation::SimulationParams params;
    params.scene = "corridor";
    params.frames = 40;
    params.step = 0.1;
    params.width = 320;
    params.height = 240;
    params.clouds = false;
    params.images = true;
    params.threads = 2;
    return evaluation::Simulation(params);
  }();
  static std::map<std::size_t, Pair> made;
  const auto found = made.find(index);
  if (found != made.end()) return found->second;
  evaluation::SimulatedFrame frame = simulation.frame(index);
  return made
      .emplace(index, Pair{std::move(frame.left), std::move(frame.right), frame.T_world_camera})
      .first->second;
}

class StereoCorridor : public CliTest {
 protected:
  static constexpr const char* kCalibration =
      "image_width: 320\nimage_height: 240\nfx: 250\nfy: 250\ncx: 159.5\ncy: 119.5\n";

  void SetUp() override { writeCalibration("baseline_m: 0.12\n"); }

  void writeCalibration(const std::string& rest) const {
    write("seq/calib.yaml", kCalibration + rest);
  }
  std::string imagePath(const char* side, std::size_t number) const {
    std::string name = std::to_string(number);
    name.insert(0, 6 - name.size(), '0');
    return directory_ / (std::string("seq/") + side + "/" + name + ".png");
  }
  void writePair(std::size_t number, const io::Image& left, const io::Image& right) const {
    for (const char* side : {"left", "right"}) {
      fs::create_directories(directory_ / (std::string("seq/") + side));
      io::writeImage(imagePath(side, number), side[0] == 'l' ? left : right);
    }
  }
  /// Frames of the corridor, in this order.
  void writeCorridor(const std::vector<std::size_t>& frames) const {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const Pair& pair = corridorPair(frames[i]);
      writePair(i, pair.left, pair.right);
    }
  }
  ProgramResult runStereo(const std::vector<std::string>& more = {}) const {
    return planarMap(joined({"run", config("stereo_indoor.yaml"), "-i", directory_ / "seq", "-o",
                             directory_ / "out", "-q", "--force"},
                            more));
  }
  void expectRefused(const std::string& part) const {
    const ProgramResult result = expectExit(4, runStereo(), part);
    EXPECT_TRUE(list("out").empty());
  }
  /// The run gets through with a warning; \p skipped of its frames are not in the map.
  void expectDegraded(std::size_t frames, std::size_t skipped, const std::string& part) const {
    const ProgramResult result = expectExit(0, runStereo());
    expectOneSentence(result, part);
    const Json metrics = Json::parse(read("out/metrics.json"));
    EXPECT_EQ(frames, metrics["frames"]);
    EXPECT_EQ(skipped, metrics["frames_skipped"]);
    EXPECT_GT(metrics["planes"], 0);
    EXPECT_EQ(frames - skipped, trajectory().size());
    EXPECT_EQ(5, runStereo({"--strict"}).exit_code);
  }
  std::vector<io::StampedPose> trajectory() const {
    return io::readTumPoses(directory_ / "out/trajectory_tum.txt");
  }
  /// The poses found, whose times count these frames of the corridor, are as far apart as the true
  /// ones.
  static void expectOnTheWay(const std::vector<io::StampedPose>& used,
                             const std::vector<std::size_t>& frames, double tolerance) {
    const Pose T_start = corridorPair(0).T_world_camera.inverse();
    for (const io::StampedPose& stamped : used) {
      const std::size_t frame = frames[static_cast<std::size_t>(stamped.timestamp)];
      const Pose expected = T_start * corridorPair(frame).T_world_camera;
      const Pose found = used.front().pose.inverse() * stamped.pose;
      EXPECT_LT((found.translation() - expected.translation()).norm(), tolerance) << frame;
    }
  }
  /// The true poses of frames of the corridor, each changed.
  template <typename Change>
  void writePoses(const std::vector<std::size_t>& frames, const Change& change) const {
    std::vector<io::StampedPose> poses;
    for (const std::size_t frame : frames)
      poses.push_back(
          {0.1 * static_cast<double>(frame), change(corridorPair(frame).T_world_camera)});
    io::writeTumPoses(directory_ / "seq/poses.txt", poses, io::Overwrite::Allow);
  }
  void truncate(const std::string& path) const { fs::resize_file(path, fs::file_size(path) / 2); }
};

}  // namespace planar_mapping
