// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// Given poses that are not those of the images are said with the first frames.
#include "stereo_corridor.h"

namespace planar_mapping {
namespace {

class GivenPoses : public StereoCorridor {
 protected:
  /// \param change  what is wrong with the poses
  template <typename Change>
  std::string warningOf(const Change& change) {
    const std::vector<std::size_t> frames = {0, 2, 4, 6, 8};
    for (const char* side : {"left", "right"})
      fs::remove_all(directory_ / (std::string("seq/") + side));
    writeCorridor(frames);
    writePoses(frames, change);
    return runStereo().err;
  }
  static constexpr const char* kWarning = "its given pose contradicts the images";
};

TEST_F(GivenPoses, OfAnotherConventionOrUnitAreSaid) {
  EXPECT_EQ("", warningOf([](const Pose& pose) { return pose; }));
  Pose half_turn = Pose::Identity();
  half_turn.linear() = Vector3(1.0, -1.0, -1.0).asDiagonal();
  EXPECT_NE(std::string::npos,
            warningOf([&](const Pose& pose) { return pose * half_turn; }).find(kWarning));
  EXPECT_NE(std::string::npos,
            warningOf([](const Pose& pose) { return pose.inverse(); }).find(kWarning));
  const std::string scaled = warningOf([](Pose pose) {
    pose.translation() *= 1.8;
    return pose;
  });
  EXPECT_NE(std::string::npos, scaled.find(kWarning)) << scaled;
  EXPECT_NE(std::string::npos, scaled.find("--set motion_estimation.poses=ignore")) << scaled;
}

/// A baseline ten times too large, or a principal point far off: given poses tell.
TEST_F(GivenPoses, CalibrationOfAnotherCameraIsSaid) {
  const auto right = [](const Pose& pose) { return pose; };
  warningOf(right);
  writeCalibration("baseline_m: 1.2\n");
  EXPECT_NE(std::string::npos, warningOf(right).find(kWarning));
  std::string calibration = std::string(kCalibration) + "baseline_m: 0.12\n";
  calibration.replace(calibration.find("159.5"), 5, "259.5");
  write("seq/calib.yaml", calibration);
  EXPECT_NE(std::string::npos, warningOf(right).find(kWarning));
}

}  // namespace
}  // namespace planar_mapping
