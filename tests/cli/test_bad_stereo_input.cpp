// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Every way in which stereo images go wrong: an exit code, one sentence, and the frames that can be
// used are used.
#include "stereo_corridor.h"

namespace planar_mapping {
namespace {

class BadStereoInput : public StereoCorridor {};

TEST_F(BadStereoInput, SoundPairsAreMappedWithoutAWord) {
  writeCorridor({0, 1, 2});
  const ProgramResult result = expectExit(0, runStereo({"--strict"}));
  EXPECT_EQ("", result.err);
  EXPECT_EQ(3u, trajectory().size());
}

TEST_F(BadStereoInput, MissingRightImageCostsItsFrame) {
  writeCorridor({0, 1, 2});
  fs::remove(imagePath("right", 1));
  expectDegraded(3, 1, "1 of 3 frames left out");
  EXPECT_NE(std::string::npos, read("out/frames.csv").find("has no right image of the same name"));
}

TEST_F(BadStereoInput, MissingRightFolder) {
  writeCorridor({0});
  fs::remove_all(directory_ / "seq/right");
  expectRefused("right: no such directory");
}

TEST_F(BadStereoInput, DifferentSizesCostTheFrame) {
  writeCorridor({0, 1});
  io::Image cut = corridorPair(1).right;
  cut.height = 200;
  cut.pixels.resize(std::size_t{320} * 200);
  fs::remove(imagePath("right", 1));
  io::writeImage(imagePath("right", 1), cut);
  expectDegraded(2, 1, "is 320 x 200, its left image 320 x 240");
}

TEST_F(BadStereoInput, WrongCalibrationKeys) {
  writeCorridor({0});
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"", "calib.yaml: has no key 'baseline_m'"},
      {"baseline: 0.12\n", "calib.yaml: line 7: unknown key 'baseline'"},
      {"baseline_m: -0.12\n", "calib.yaml: line 7: baseline_m"},
      {"baseline_m: wide\n", "calib.yaml: line 7: baseline_m is no number"},
      {"baseline_m: 0.12\nfx: 250\n", "calib.yaml: line 8: key 'fx' twice"}};
  for (const auto& entry : wrong) {
    writeCalibration(entry.first);
    expectRefused(entry.second);
  }
  write("seq/calib.yaml", "image_width: 320\nimage_height: 240\nbaseline_m: 0.12\n");
  expectRefused("calib.yaml: has no key 'fx'");
}

TEST_F(BadStereoInput, CalibrationOfAnotherImageIsRefused) {
  writeCorridor({0, 1});
  for (const auto& [right, wrong, part] :
       {std::tuple("320", "640", "is 320 x 240, but its calibration says 640 x 240"),
        {"159.5", "700.5", "calib.yaml: line 5: cx is far outside an image 320 wide"}}) {
    std::string calibration = std::string(kCalibration) + "baseline_m: 0.12\n";
    calibration.replace(calibration.find(right), std::strlen(right), wrong);
    write("seq/calib.yaml", calibration);
    expectRefused(part);
  }
}

TEST_F(BadStereoInput, JumpsOfTheExposureMoveNoPose) {
  // Every other pair is darker by half, as after a door that opens to the light.
  const std::vector<std::size_t> frames = {0, 1, 2, 3, 4, 5, 6, 7};
  for (const std::size_t frame : frames) {
    Pair pair = corridorPair(frame);
    for (io::Image* image : {&pair.left, &pair.right}) {
      for (std::uint8_t& pixel : image->pixels) pixel /= frame % 2 == 0 ? 1 : 2;
    }
    writePair(frame, pair.left, pair.right);
  }
  const ProgramResult result = expectExit(0, runStereo());
  const std::vector<io::StampedPose> used = trajectory();
  EXPECT_GE(used.size(), 7u) << result.err;
  expectOnTheWay(used, frames, 0.05);
}

TEST_F(BadStereoInput, SwappedLeftAndRightIsSaid) {
  for (std::size_t i = 0; i < 2; ++i) writePair(i, corridorPair(i).right, corridorPair(i).left);
  expectRefused("exchanged: ");
}

TEST_F(BadStereoInput, PairsThatAreNotRectifiedAreSaid) {
  // The right camera is turned down by four rows.
  for (std::size_t i = 0; i < 2; ++i) {
    Pair pair = corridorPair(i);
    std::vector<std::uint8_t>& pixels = pair.right.pixels;
    const auto rows = static_cast<std::ptrdiff_t>(4 * pair.right.width * pair.right.channels);
    std::copy(pixels.begin() + rows, pixels.end(), pixels.begin());
    writePair(i, pair.left, pair.right);
  }
  const ProgramResult result = runStereo();
  EXPECT_NE(std::string::npos, result.err.find("the pair is not rectified")) << result.err;
  EXPECT_NE(std::string::npos, result.err.find(" rows apart")) << result.err;
}

TEST_F(BadStereoInput, BlackImageCostsItsFrame) {
  writeCorridor({0, 1, 2});
  io::Image black = corridorPair(1).left;
  std::fill(black.pixels.begin(), black.pixels.end(), std::uint8_t{0});
  fs::remove(imagePath("left", 1));
  fs::remove(imagePath("right", 1));
  writePair(1, black, black);
  expectDegraded(3, 1, "black");
}

TEST_F(BadStereoInput, NothingButBlackImagesOrNoTexture) {
  for (const auto& [gray, part] : {std::pair(0, "black"), {128, "no texture"}}) {
    io::Image even = corridorPair(0).left;
    std::fill(even.pixels.begin(), even.pixels.end(), static_cast<std::uint8_t>(gray));
    for (const char* side : {"left", "right"}) fs::remove(imagePath(side, 0));
    writePair(0, even, even);
    expectRefused(part);
  }
}

TEST_F(BadStereoInput, FrozenCameraAddsNothing) {
  writeCorridor({0, 1, 1, 1, 2});
  expectDegraded(5, 2, "frozen");
}

TEST_F(BadStereoInput, JumpOfTwoMetresIsBridgedOrLeftOutButNeverMisplaced) {
  const std::vector<std::size_t> frames = {0, 1, 2, 22, 23, 24};
  writeCorridor(frames);
  const ProgramResult result = expectExit(0, runStereo());
  EXPECT_LE(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  const std::vector<io::StampedPose> used = trajectory();
  ASSERT_GE(used.size(), 3u);
  expectOnTheWay(used, frames, 0.15);
}

TEST_F(BadStereoInput, TimesOutOfOrderAreTakenAsTheyComeWithAWarning) {
  writeCorridor({0, 1, 2});
  std::vector<io::StampedPose> poses;
  for (const double time : {10.0, 12.0, 11.0})
    poses.push_back({time, corridorPair(poses.size()).T_world_camera});
  io::writeTumPoses(directory_ / "seq/poses.txt", poses);
  expectDegraded(3, 0, "its time, 11 s, is before that of the frame before it, 12 s");
  EXPECT_EQ(11.0, trajectory()[2].timestamp);
}

TEST_F(BadStereoInput, QuaternionsAreNormalisedWithinAThousandth) {
  writeCorridor({0, 1});
  write("seq/poses.txt", "0 0 0 0 0 0 0 1.0009\n1 0 0 0.1 0 0 0 0.9991\n");
  expectExit(0, runStereo());
  ASSERT_EQ(2u, trajectory().size());
  fs::remove_all(directory_ / "out");
  write("seq/poses.txt", "0 0 0 0 0 0 0 1\n1 0 0 0.1 0 0 0 0.99\n");
  expectRefused("poses.txt: line 2: the quaternion has length 0.99 instead of 1");
}

TEST_F(BadStereoInput, TruncatedPngCostsItsFrame) {
  writeCorridor({0, 1, 2});
  truncate(imagePath("left", 0));
  expectDegraded(3, 1, "left/000000.png");
}

TEST_F(BadStereoInput, NothingButTruncatedPngs) {
  writeCorridor({0, 1});
  truncate(imagePath("left", 0));
  truncate(imagePath("right", 1));
  expectRefused("nor can any other frame be used");
}

TEST_F(BadStereoInput, StagesThatAreMissingAreNamed) {
  writeCorridor({0});
  expectExit(4, runStereo({"--set", "motion_estimation.enabled=false"}), "motion_estimation");
  expectExit(4,
             planarMap({"run", config("pcd_sequence.yaml"), "-i", directory_ / "seq", "-o",
                        directory_ / "out", "-q"}),
             "stereo_matching");
  const std::string cloud = room();
  expectExit(
      4,
      planarMap({"run", config("stereo_indoor.yaml"), "-i", cloud, "-o", directory_ / "out", "-q"}),
      "there are no image pairs");
}

TEST_F(BadStereoInput, ResumedRunEqualsTheOneInOneGo) {
  writeCorridor({0, 1, 2, 3, 4, 5});
  fs::remove(imagePath("right", 2));
  ASSERT_EQ(0, runStereo().exit_code);
  const std::string whole_map = read("out/map.pmap");
  const std::string whole_trajectory = read("out/trajectory_tum.txt");
  fs::remove_all(directory_ / "out");
  ProgramOptions options;
  auto sent = std::make_shared<bool>(false);
  options.while_running = [sent](pid_t child, const std::string& err) {
    if (*sent || err.find("\"done\":3") == std::string::npos) return;
    *sent = true;
    ::kill(child, SIGINT);
  };
  const std::vector<std::string> run = {
      "run",  config("stereo_indoor.yaml"), "-i", directory_ / "seq",
      "-o",   directory_ / "out",           "-q", "--progress",
      "jsonl"};
  ASSERT_EQ(130, planarMap(run, options).exit_code);
  expectExit(0, planarMap(joined(run, {"--resume"})));
  EXPECT_EQ(whole_map, read("out/map.pmap"));
  EXPECT_EQ(whole_trajectory, read("out/trajectory_tum.txt"));
  EXPECT_EQ(1, Json::parse(read("out/metrics.json"))["frames_skipped"]);
}

}  // namespace
}  // namespace planar_mapping
