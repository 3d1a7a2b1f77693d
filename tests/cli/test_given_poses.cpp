// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Given poses that are not those of the images: the first frame that shows it is named, with the
// cause where it can be told.
#include <algorithm>
#include <random>
#include <regex>

#include "stereo_corridor.h"

namespace planar_mapping {
namespace {

class GivenPoses : public StereoCorridor {};

/// A baseline ten times too large, or a principal point far off: given poses tell.
TEST_F(GivenPoses, CalibrationOfAnotherCameraIsSaid) {
  const std::vector<std::size_t> frames = {0, 2, 4, 6, 8};
  writeCorridor(frames);
  writePoses(frames, [](const Pose& pose) { return pose; });
  EXPECT_EQ("", runStereo().err);
  writeCalibration("baseline_m: 1.2\n");
  const std::string err = runStereo().err;
  EXPECT_NE(std::string::npos, err.find("its given pose contradicts the images"));
  EXPECT_TRUE(std::regex_search(err, std::regex("(9|10)(\\.[0-9]+)? times that of the poses")))
      << err;
  std::string calibration = std::string(kCalibration) + "baseline_m: 0.12\n";
  calibration.replace(calibration.find("159.5"), 5, "259.5");
  write("seq/calib.yaml", calibration);
  EXPECT_NE(std::string::npos, runStereo().err.find("its given pose contradicts the images"));
}

/// Poses of OpenGL's cameras, and T_camera_world in place of T_world_camera.
TEST_F(GivenPoses, PosesOfAnotherConventionAreNamed) {
  const std::vector<std::size_t> frames = {0, 2, 4, 6, 8};
  writeCorridor(frames);
  Pose half_turn = Pose::Identity();
  half_turn.linear() = Vector3(1.0, -1.0, -1.0).asDiagonal();
  writePoses(frames, [&](const Pose& pose) { return pose * half_turn; });
  EXPECT_NE(std::string::npos, runStereo().err.find("(OpenGL; turn each by 180 degrees"));
  writePoses(frames, [](const Pose& pose) { return pose.inverse(); });
  EXPECT_NE(std::string::npos, runStereo().err.find("(give their inverses)"));
  // Straight ahead from where the world begins each is the other.
  const Pose start = corridorPair(0).T_world_camera;
  writePoses(frames, [&](const Pose& pose) { return Pose(start.inverse() * pose).inverse(); });
  const std::string err = runStereo().err;
  EXPECT_NE(std::string::npos, err.find("(OpenGL; turn each")) << err;
  EXPECT_NE(std::string::npos, err.find(", or of the world in the camera's frame")) << err;
}

/// What agreed with the images for long is of the right convention.
TEST_F(GivenPoses, PosesThatGoWrongLaterAreNotCalledInverse) {
  const std::vector<std::size_t> frames = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  writeCorridor(frames);
  std::vector<io::StampedPose> poses;
  for (const std::size_t frame : frames) {
    const Pose step = corridorPair(8).T_world_camera.inverse() * corridorPair(9).T_world_camera;
    Pose pose = corridorPair(frame).T_world_camera;
    if (frame == 9) pose = corridorPair(8).T_world_camera * step.inverse();
    poses.push_back({0.1 * static_cast<double>(frame), pose});
  }
  io::writeTumPoses(directory_ / "seq/poses.txt", poses);
  const std::string err = runStereo().err;
  EXPECT_NE(std::string::npos, err.find("contradicts the images")) << err;
  EXPECT_EQ(std::string::npos, err.find("(give their inverses)")) << err;
}

/// Offsets add up over frames: they say nothing of a step.
TEST_F(GivenPoses, CausesAreThoseOfOneStep) {
  const auto warningOf = [&](std::size_t stride, double scale) {
    std::vector<std::size_t> frames;
    for (std::size_t i = 0; i < 7; ++i) frames.push_back(stride * i);
    for (const char* side : {"left", "right"})
      fs::remove_all(directory_ / (std::string("seq/") + side));
    writeCorridor(frames);
    writePoses(frames, [&](Pose pose) {
      pose.translation() *= scale;
      return pose;
    });
    return runStereo().err;
  };
  const std::string wrong = warningOf(2, 1.8);
  EXPECT_NE(std::string::npos, wrong.find("frame 2 ")) << wrong;
  EXPECT_NE(std::string::npos, wrong.find(" 0.56 times that of the poses")) << wrong;
  // By the offset of three steps they seemed to look along -z.
  const std::string late = warningOf(1, 2.2);
  EXPECT_NE(std::string::npos, late.find("contradicts the images")) << late;
  EXPECT_EQ(std::string::npos, late.find("OpenGL")) << late;
}

/// A recorder wrote a static transform; the images have too little in common to tell the motion.
TEST_F(GivenPoses, ThatStayTheSameWhileTheCameraMovesAreNamed) {
  const std::vector<std::size_t> frames = {0, 13, 26, 39};
  writeCorridor(frames);
  writePoses({0, 1, 2, 3}, [](const Pose&) { return corridorPair(0).T_world_camera; });
  const std::string err = runStereo().err;
  EXPECT_NE(std::string::npos, err.find("the given poses of frames 0 to 2 ")) << err;
  EXPECT_NE(std::string::npos, err.find("what is seen moves")) << err;
}

/// Noise, and a thing that passes through a quarter of the image.
TEST_F(GivenPoses, ThatStayTheSameBecauseTheCameraDoesAreNot) {
  const Pair& pair = corridorPair(0);
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 4.0);
  for (std::size_t i = 0; i < 5; ++i) {
    Pair noisy = pair;
    for (io::Image* image : {&noisy.left, &noisy.right})
      for (std::uint8_t& gray : image->pixels)
        gray = static_cast<std::uint8_t>(std::clamp(gray + noise(random), 0.0, 255.0));
    for (std::size_t row = 0; row < 240; ++row) {
      std::fill_n(&noisy.left.pixels[row * 320 + 55 * i + 20], 80, std::uint8_t{200});
      std::fill_n(&noisy.right.pixels[row * 320 + 55 * i], 80, std::uint8_t{200});
    }
    writePair(i, noisy.left, noisy.right);
  }
  writePoses({0, 1, 2, 3, 4}, [&](const Pose&) { return pair.T_world_camera; });
  EXPECT_EQ("", runStereo().err);
}

}  // namespace
}  // namespace planar_mapping
