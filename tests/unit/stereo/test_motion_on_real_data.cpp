// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "feature_corridor.h"
#include "planar_mapping/core/odometry/odometry.h"
#include "planar_mapping/evaluation/trajectory_error.h"
#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/image_file.h"
#include "planar_mapping/io/pose_file.h"
#include "planar_mapping/stereo/feature_tracker.h"

namespace planar_mapping {
namespace {

std::string dataFolder(const std::string& name) {
  return std::string(PLANAR_MAPPING_SOURCE_DIR) + "/../shared/data/" + name;
}

struct Trajectories {
  std::vector<Pose> estimate;
  std::vector<Pose> reference;
};

/// Follows the camera over frames first .. last of a folder of stereo pairs.
Trajectories follow(const std::string& folder, int first, int last) {
  const io::Calibration calibration = io::readCalibration(folder + "/calib.yaml");
  const std::vector<io::StampedPose> poses = io::readTumPoses(folder + "/poses.txt");
  const PinholeCamera& camera = calibration.camera;
  OdometryParams params;
  params.camera =
      test::stereoCamera(camera.fx, camera.fy, camera.cx, camera.cy, *calibration.baseline);
  Odometry odometry(params);
  FeatureTracker tracker;
  Trajectories result;
  for (int i = first; i <= last; ++i) {
    char name[16];
    std::snprintf(name, sizeof(name), "/%06d.png", i);
    const io::Image left = io::readImage(folder + "/left" + name);
    const io::Image right = io::readImage(folder + "/right" + name);
    const OdometryResult found = odometry.update(tracker.track(left, right, calibration));
    EXPECT_TRUE(found.registered) << "frame " << i << ": " << found.reason;
    if (!found.registered) continue;
    result.estimate.push_back(found.T_world_sensor);
    result.reference.push_back(poses[static_cast<std::size_t>(i)].pose);
  }
  return result;
}

TEST(MotionOnRealData, StreetDriftsByLessThanTwoPercent) {
  const std::string folder = dataFolder("stereo_kitti_street");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const Trajectories street = follow(folder, 0, 27);
  const TrajectoryError error = trajectoryError(street.estimate, street.reference);
  EXPECT_EQ(error.poses, 28u);
  EXPECT_GT(error.path_length, 32.0);
  EXPECT_LT(error.endDriftPercent(), 2.0);
  EXPECT_LT(error.absolute_rms, 0.1);
}

TEST(MotionOnRealData, CameraAtRestStaysWhereItIs) {
  const std::string folder = dataFolder("stereo_euroc_room");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const Trajectories rest = follow(folder, 0, 9);
  ASSERT_EQ(rest.estimate.size(), 10u);
  EXPECT_LT(trajectoryError(rest.estimate, rest.reference).end_translation, 0.005);
}

TEST(MotionOnRealData, TwoViewsOfARoomAreRegistered) {
  const std::string folder = dataFolder("stereo_euroc_room");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const Trajectories views = follow(folder, 10, 11);
  ASSERT_EQ(views.estimate.size(), 2u);
  const TrajectoryError error = trajectoryError(views.estimate, views.reference);
  EXPECT_LT(error.end_translation, 0.05);
  EXPECT_LT(error.end_rotation, 0.01);
}

}  // namespace
}  // namespace planar_mapping
