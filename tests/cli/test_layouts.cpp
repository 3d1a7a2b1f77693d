// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "cli_fixture.h"
#include "dataset_layouts.h"

namespace planar_mapping {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

/// A simulated sequence as our own folder, and the same frames as a public data set of each kind
/// has them: the map must be the same, byte for byte. All layouts: LayoutFolders of tests/unit/io.
class Layouts : public CliTest {
 protected:
  void simulate(const std::string& name, const std::vector<std::string>& more) const {
    ASSERT_EQ(0, planarMap(joined({"simulate", "corridor", "-o", directory_ / name, "-q", "--step",
                                   "0.2", "--frames", "3"},
                                  more))
                     .exit_code);
  }
  std::string stereo() const {
    simulate("native", {"--write", "images", "--width", "320", "--height", "240"});
    return directory_ / "native";
  }
  /// The left images with their true depths.
  std::string rgbd() const {
    const std::string native = stereo();
    fs::rename(native + "/left", native + "/rgb");
    fs::rename(native + "/depth_gt", native + "/depth");
    fs::remove_all(native + "/right");
    fs::remove_all(native + "/labels_gt");
    write("native/calib.yaml",
          "image_width: 320\nimage_height: 240\nfx: 250\nfy: 250\ncx: 159.5\ncy: 119.5\n"
          "depth_scale: 1000\n");
    return native;
  }
  void expectSameMap(const std::string& native, const std::string& configuration,
                     const std::string& folder, const std::string& layout) const {
    expectExit(0, planarMap({"run", config(configuration), "-i", native, "-o",
                             directory_ / "of_native", "-q"}));
    const ProgramResult result =
        expectExit(0, planarMap({"run", folder, "-o", directory_ / "of_layout"}));
    EXPECT_EQ(0u, result.err.find("planar_map: " + folder + ": " + layout)) << result.err;
    EXPECT_NE(std::string::npos, result.err.find(configuration)) << result.err;
    EXPECT_GT(Json::parse(read("of_layout/metrics.json"))["planes"], 0);
    EXPECT_TRUE(read("of_native/map.pmap") == read("of_layout/map.pmap"));
    // The same again from what it left.
    const ProgramResult again =
        expectExit(0, planarMap({"run", directory_ / "of_layout/config.resolved.yaml", "-o",
                                 directory_ / "again", "-q"}));
    EXPECT_TRUE(read("again/map.pmap") == read("of_layout/map.pmap"));
  }
};

TEST_F(Layouts, KittiOdometryGivesTheMapOfTheSameFolder) {
  const std::string native = stereo();
  expectSameMap(native, "stereo_indoor.yaml", layout_test::toKitti(native, directory_ / "kitti"),
                "KITTI odometry (gray): 3 image pairs, poses of a file");
}

TEST_F(Layouts, KittiScansGiveTheMapOfTheSameClouds) {
  simulate("native", {"--width", "160", "--height", "120"});
  const std::string native = directory_ / "native";
  for (const std::string& file : layout_test::filesIn(native + "/clouds")) {
    io::CloudData cloud = io::readCloudFile(file, io::CloudChannels::none());
    std::vector<float> finite;
    for (std::size_t i = 0; i < cloud.size(); ++i)
      if (cloud.view().isMeasured(i))
        finite.insert(finite.end(), &cloud.xyz[3 * i], &cloud.xyz[3 * i] + 3);
    cloud.xyz = finite;
    cloud.width = static_cast<std::uint32_t>(finite.size() / 3);
    cloud.height = 1;
    io::writePcd(file, cloud, io::Overwrite::Allow);
  }
  fs::remove(native + "/calib.yaml");  // the scans have no camera
  expectSameMap(native, "pcd_sequence.yaml", layout_test::toVelodyne(native, directory_ / "kitti"),
                "KITTI odometry (velodyne): 3 clouds, poses of a file");
}

TEST_F(Layouts, TumGivesTheMapOfTheSameFolder) {
  const std::string native = rgbd();
  const std::string folder = layout_test::toTum(native, directory_ / "tum");
  write("tum/calib.yaml", read("native/calib.yaml"));
  expectSameMap(native, "rgbd_indoor.yaml", folder, "TUM RGB-D: 3 RGB-D frames, poses of a file");
}

TEST_F(Layouts, CalibrationMayBeGivenByAnOption) {
  const std::string native = rgbd();
  const std::string folder = layout_test::toTum(native, directory_ / "tum");
  expectExit(4, planarMap({"run", folder, "-o", directory_ / "out", "-q"}), "--calib FILE");
  expectExit(0, planarMap({"run", folder, "--calib", native + "/calib.yaml", "-o",
                           directory_ / "out", "-q"}));
  EXPECT_NE(std::string::npos, read("out/config.resolved.yaml").find("calibration: "));
}

TEST_F(Layouts, EurocGivesTheMapOfTheSameFolder) {
  const std::string native = stereo();
  write("native/calib.yaml",
        "image_width: 320\nimage_height: 240\nfx: 250\nfy: 250\ncx: 159.5\ncy: 119.5\n"
        "rotation: [1, 0, 0, 0, 1, 0, 0, 0, 1]\ntranslation_m: [-0.12, 0, 0]\nk1: 0.001\n"
        "k2_right: 0.0005\ncx_right: 159.25\n");
  std::vector<io::StampedPose> poses = io::readTumPoses(native + "/poses.txt");
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].timestamp = 0.1 * static_cast<double>(i);
  io::writeTumPoses(native + "/poses.txt", poses, io::Overwrite::Allow);
  expectSameMap(native, "stereo_indoor.yaml", layout_test::toEuroc(native, directory_ / "euroc"),
                "EuRoC (ASL): 3 image pairs, poses of a file");
}

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
  EXPECT_NE(std::string::npos, result.err.find("EuRoC (ASL): 4 image pairs, no poses"));
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
      const std::vector<std::string> files = layout_test::filesIn(directory_ / "native/clouds");
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
