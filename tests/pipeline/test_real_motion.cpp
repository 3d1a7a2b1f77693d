// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// The camera's motion on real sequences, where features alone do not give it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "planar_mapping/localization/trajectory_error.h"
#include "planar_mapping/pipeline/sequence_source.h"
#include "real_run.h"
#include "temporary_directory.h"

namespace planar_mapping {
namespace {

/// Poses of frames [first, last) of a sequence beside the sources; given ones only measure.
RealRun travel(const std::string& configuration_file, const std::vector<std::string>& inputs,
               int first, int last, int threads = 1, int step = 1, bool images = true,
               const std::string& poses = "ignore") {
  std::vector<std::string> assignments = {"motion_estimation.enabled=true",
                                          "motion_estimation.poses=" + poses,
                                          "threads=" + std::to_string(threads)};
  return runOver(inputs, {first, last, step}, configuration_file, assignments, images, true);
}

/// Degrees between what the map takes for upwards and what is.
double leanOf(const RealRun& travelled) {
  const Vector3 up = travelled.given.front().linear().transpose() * Vector3::UnitZ();
  const Vector3 in_map = travelled.estimated.front().linear() * up;
  return std::atan2(in_map.head<2>().norm(), in_map.z()) * 180.0 / M_PI;
}

#define SKIP_IF_MISSING(name) \
  if (test::isMissing(name)) GTEST_SKIP() << name << " is not beside the sources"

TEST(RealMotion, PlainCabinetIsWalkedAround) {
  SKIP_IF_MISSING("rgbd_tum_cabinet");
  // Hardly any feature; turns of up to 17 degrees from frame to frame.
  const RealRun cabinet = travel("rgbd_indoor.yaml", {"rgbd_tum_cabinet"}, 0, -1);
  EXPECT_LE(cabinet.skipped, 4u);  // the last ones, a component of their own
  const TrajectoryError error = trajectoryError(cabinet.estimated, cabinet.given);
  EXPECT_GT(error.path_length, 7.5);
  EXPECT_LT(error.absolute_rms, 0.04);
  EXPECT_LT(error.endDriftPercent(), 1.5);
  EXPECT_LT(leanOf(cabinet), 3.0);  // the floor's depth is off by 2 to 5 cm beyond 2 m
}

TEST(RealMotion, TiltedFirstViewDoesNotMakeTheMapLean) {
  SKIP_IF_MISSING("rgbd_tartanair_corridor");
  const RealRun corridor = travel("rgbd_indoor.yaml", {"rgbd_tartanair_corridor"}, 0, 12);
  EXPECT_EQ(0u, corridor.skipped);
  EXPECT_LT(leanOf(corridor), 0.3);
  EXPECT_LT(trajectoryError(corridor.estimated, corridor.given).absolute_rms, 0.01);
  // Here the planes are too inexact to tell: level, which is not worse than before.
  const RealRun room = travel("stereo_indoor.yaml", {"stereo_euroc_room"}, 0, 1);
  EXPECT_LT(leanOf(room), 22.0);
}

TEST(RealMotion, ViewsOfARoomAreRegisteredByTheirClouds) {
  SKIP_IF_MISSING("clouds_pcl/capture0001.pcd");
  // No images, no poses: forwards and backwards must tell the same.
  std::vector<std::string> views;
  for (const char* number : {"1", "2", "3", "4", "5"})
    views.push_back(std::string("clouds_pcl/capture000") + number + ".pcd");
  const RealRun forwards = travel("pcd_sequence.yaml", views, 0, -1);
  std::reverse(views.begin(), views.end());
  const RealRun backwards = travel("pcd_sequence.yaml", views, 0, -1);
  ASSERT_EQ(5u, forwards.estimated.size());
  ASSERT_EQ(5u, backwards.estimated.size());
  for (std::size_t i = 0; i + 1 < 5; ++i) {
    const Pose step = forwards.estimated[i].inverse() * forwards.estimated[i + 1];
    const Pose same = backwards.estimated[4 - i].inverse() * backwards.estimated[3 - i];
    EXPECT_GT(step.translation().norm(), 0.1);
    EXPECT_LT(step.translation().norm(), 0.3);
    const Pose apart = step.inverse() * same;
    EXPECT_LT(apart.translation().norm(), 0.02);
    EXPECT_LT(Eigen::AngleAxisd(Matrix3(apart.linear())).angle(), 0.01);
  }
}

TEST(RealMotion, ScansFarApartAreRegisteredByTheirPlanes) {
  // Two scans of a room, 2 m and 41 degrees apart, with nothing known about it. The reference is
  // PCL's ICP from a guess by hand: (1.977, 0.057), 0.712 rad.
  const std::vector<std::string> scans = {"clouds_pcl/room_scan1.pcd", "clouds_pcl/room_scan2.pcd"};
  const RealRun there = travel("pcd_sequence.yaml", scans, 0, -1);
  ASSERT_EQ(2u, there.estimated.size());
  const Pose step = there.estimated[0].inverse() * there.estimated[1];
  EXPECT_NEAR(1.977, step.translation().x(), 0.03);
  EXPECT_NEAR(0.057, step.translation().y(), 0.03);
  EXPECT_NEAR(0.712, Eigen::AngleAxisd(Matrix3(step.linear())).angle(), 0.01);
  const RealRun back = travel("pcd_sequence.yaml", {scans[1], scans[0]}, 0, -1);
  ASSERT_EQ(2u, back.estimated.size());
  const Pose closed = step * (back.estimated[0].inverse() * back.estimated[1]);
  EXPECT_LT(closed.translation().norm(), 0.05);
  EXPECT_LT(Eigen::AngleAxisd(Matrix3(closed.linear())).angle(), 0.01);
}

TEST(RealMotion, FramesFarApartAreFound) {
  SKIP_IF_MISSING("rgbd_icl_livingroom");
  // Every twelfth frame, no images: steps of up to 1 m.
  const RealRun sofa = travel("rgbd_indoor.yaml", {"rgbd_icl_livingroom"}, 0, -1, 1, 12, false);
  EXPECT_EQ(0u, sofa.skipped);
  EXPECT_LT(trajectoryError(sofa.estimated, sofa.given).absolute_rms, 0.02);
}

/// Steps between frames that were used which are off by more than 5 degrees, or 10 cm and 5 %.
std::size_t wrongSteps(const RealRun& travelled) {
  std::size_t wrong = 0;
  for (std::size_t i = 1; i < travelled.estimated.size(); ++i) {
    const Pose found = travelled.estimated[i - 1].inverse() * travelled.estimated[i];
    const Pose truth = travelled.given[i - 1].inverse() * travelled.given[i];
    const Pose apart = truth.inverse() * found;
    const bool far = apart.translation().norm() > 0.1 + 0.05 * truth.translation().norm();
    wrong += far || Eigen::AngleAxisd(Matrix3(apart.linear())).angle() > M_PI / 36.0 ? 1 : 0;
  }
  return wrong;
}

TEST(RealMotion, ABoxIsNotTakenForItsOtherSide) {
  SKIP_IF_MISSING("rgbd_tum_cabinet");
  // By depth alone the cabinet looks the same from behind, 180 degrees later. All but the first
  // frame are left out.
  for (const int step : {4, 5}) {
    const RealRun around = travel("rgbd_indoor.yaml", {"rgbd_tum_cabinet"}, 0, -1, 1, step, false);
    EXPECT_EQ(0u, wrongSteps(around)) << step;
    EXPECT_GT(around.skipped, 0u) << step;
  }
}

TEST(RealMotion, FewViewsFarApartAreAllPlaced) {
  // Views of a room that share a third of what they see.
  const RealRun room = travel("rgbd_indoor.yaml", {"rgbd_icl_five"}, 0, -1);
  EXPECT_EQ(0u, room.skipped);
  EXPECT_EQ(0u, wrongSteps(room));
}

TEST(RealMotion, BiggerStepsAroundTheCabinetAreLeftOutBeforeTheyAreWrong) {
  SKIP_IF_MISSING("rgbd_tum_cabinet");
  // Its back looks like its front. Only the first frame of each is placed.
  for (const int step : {5, 8}) {
    const RealRun cabinet = travel("rgbd_indoor.yaml", {"rgbd_tum_cabinet"}, 0, -1, 1, step);
    EXPECT_EQ(0u, wrongSteps(cabinet)) << "every " << step;
  }
  // Gray values that agree by chance alone.
  const RealRun fifth = travel("rgbd_indoor.yaml", {"rgbd_tum_cabinet"}, 5, 22, 1, 8);
  EXPECT_EQ(0u, wrongSteps(fifth));
}

TEST(RealMotion, EverySecondAndThirdFrameAlongAPanelledCorridorArePlaced) {
  SKIP_IF_MISSING("rgbd_tartanair_corridor");
  const RealRun second = travel("rgbd_indoor.yaml", {"rgbd_tartanair_corridor"}, 0, 24, 1, 2);
  EXPECT_GE(second.estimated.size(), 11u);
  EXPECT_EQ(0u, wrongSteps(second));
  const RealRun third = travel("rgbd_indoor.yaml", {"rgbd_tartanair_corridor"}, 0, -1, 1, 3);
  EXPECT_GE(third.estimated.size(), 19u);
  EXPECT_EQ(0u, wrongSteps(third));
}

TEST(RealMotion, EveryFourthFrameAlongAPanelledCorridorIsLeftOutBeforeItIsWrong) {
  SKIP_IF_MISSING("rgbd_tartanair_corridor");
  const RealRun fourth = travel("rgbd_indoor.yaml", {"rgbd_tartanair_corridor"}, 0, -1, 1, 4);
  EXPECT_EQ(0u, wrongSteps(fourth));
}

TEST(RealMotion, WhereThingsRepeatAFirstStepIsRarelyTakenForAStandstill) {
  SKIP_IF_MISSING("rgbd_tartanair_corridor");
  // Two steps of about a metre in a corridor whose panels are as long: the views agree well where
  // the camera was, and nothing is known of its motion. One of 15 starts is wrong.
  std::size_t wrong = 0;
  const auto start = [&wrong](int first, int step, int frames) {
    const RealRun corridor = travel("rgbd_indoor.yaml", {"rgbd_tartanair_corridor"}, first,
                                    first + (frames - 1) * step + 1, 1, step);
    wrong += wrongSteps(corridor);
  };
  for (const int first : {0, 1, 2, 3, 4}) start(first, 5, 3);
  for (const int first : {3, 5}) start(first, 8, 3);
  for (const auto& [first, step] :
       {std::pair{3, 4}, {1, 6}, {3, 6}, {4, 6}, {2, 7}, {3, 7}, {2, 8}, {4, 8}})
    start(first, step, 5);
  EXPECT_LE(wrong, 1u);
}

TEST(RealMotion, AGivenPoseThatContradictsTheImagesIsNamed) {
  SKIP_IF_MISSING("rgbd_icl_livingroom");
  for (const double off : {0.0, 0.5}) {
    Configuration configuration = test::readyConfiguration("rgbd_indoor.yaml");
    configuration.inputs.push_back(test::realData("rgbd_icl_livingroom"));
    configuration.frames.last = 4;
    SequenceSource frames(configuration);
    Pipeline pipeline(std::move(configuration));
    std::string warnings;
    while (std::optional<Frame> frame = frames.next()) {
      if (frame->number == 2) frame->given_pose->translation().x() += off;
      pipeline.process(*frame);
      for (const std::string& warning : frame->warnings) warnings += warning + "\n";
    }
    EXPECT_EQ(off > 0.0, warnings.find("frame 2 ") != std::string::npos) << warnings;
    EXPECT_EQ(off > 0.0, warnings.find("contradicts the images") != std::string::npos);
  }
}

/// A sequence in which the depth of each frame is that of a later one.
void delayColor(const std::string& sequence, const std::filesystem::path& folder,
                std::size_t by = 1) {
  namespace fs = std::filesystem;
  const fs::path data = test::realData(sequence);
  fs::create_directories(folder / "depth");
  for (const char* name : {"calib.yaml", "poses.txt", "rgb"})
    fs::create_symlink(fs::absolute(data / name), folder / name);
  std::vector<std::string> names;
  for (const fs::directory_entry& file : fs::directory_iterator(data / "depth"))
    names.push_back(file.path().filename().string());
  std::sort(names.begin(), names.end());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string& next = names[std::min(i + by, names.size() - 1)];
    fs::create_symlink(fs::absolute(data / "depth" / next), folder / "depth" / names[i]);
  }
}

TEST(RealMotion, DepthOfAnotherMomentPlacesNoFrame) {
  const TemporaryDirectory folder;
  delayColor("rgbd_icl_five", folder.path());
  const RealRun views = travel("rgbd_indoor.yaml", {folder.path()}, 0, -1);
  EXPECT_EQ(1u, views.estimated.size());  // the first is where the map begins
  EXPECT_EQ(4u, views.skipped);
}

TEST(RealMotion, DepthOfAnotherMomentIsNotMapped) {
  SKIP_IF_MISSING("rgbd_tum_cabinet");
  const TemporaryDirectory folder;
  delayColor("rgbd_tum_cabinet", folder.path());
  const RealRun without_poses = travel("rgbd_indoor.yaml", {folder.path()}, 0, 24);
  EXPECT_GE(without_poses.skipped, 20u);
}

TEST(RealMotion, ThreadsDoNotChangeIt) {
  SKIP_IF_MISSING("rgbd_tum_cabinet");
  const RealRun one = travel("rgbd_indoor.yaml", {"rgbd_tum_cabinet"}, 16, 22, 1);
  const RealRun two = travel("rgbd_indoor.yaml", {"rgbd_tum_cabinet"}, 16, 22, 2);
  ASSERT_EQ(one.estimated.size(), two.estimated.size());
  for (std::size_t i = 0; i < one.estimated.size(); ++i)
    EXPECT_EQ(one.estimated[i].matrix(), two.estimated[i].matrix());
}

}  // namespace
}  // namespace planar_mapping
