// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/evaluation/trajectory_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace {

Pose poseAt(double x, double y, double z, double yaw = 0.0) {
  Pose pose = Pose::Identity();
  pose.translation() << x, y, z;
  pose.linear() = Eigen::AngleAxisd(yaw, Vector3::UnitZ()).toRotationMatrix();
  return pose;
}

const std::vector<Pose> kBend = {poseAt(0, 0, 0), poseAt(1, 0, 0), poseAt(2, 0, 0), poseAt(2, 1, 0),
                                 poseAt(2, 2, 1)};

TEST(TrajectoryError, EqualTrajectoriesHaveNone) {
  const TrajectoryError error = trajectoryError(kBend, kBend);
  EXPECT_EQ(error.poses, 5u);
  EXPECT_NEAR(error.path_length, 3.0 + std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(error.absolute_rms, 0.0, 1e-12);
  EXPECT_NEAR(error.relative_translation_rms, 0.0, 1e-12);
  EXPECT_NEAR(error.end_translation, 0.0, 1e-12);
  EXPECT_NEAR(error.endDriftPercent(), 0.0, 1e-12);
}

TEST(TrajectoryError, DoesNotDependOnTheWorldOfTheEstimate) {
  Pose T = poseAt(5, -3, 2, 0.7);
  T.linear() = T.linear() * Eigen::AngleAxisd(0.4, Vector3::UnitX()).toRotationMatrix();
  std::vector<Pose> moved;
  for (const Pose& pose : kBend) moved.push_back(T * pose);
  const TrajectoryError error = trajectoryError(moved, kBend);
  EXPECT_NEAR(error.absolute_rms, 0.0, 1e-12);
  EXPECT_NEAR(error.relative_rotation_rms, 0.0, 1e-7);
  EXPECT_NEAR(error.end_translation, 0.0, 1e-12);
  EXPECT_TRUE((error.T_reference_estimate * T).isApprox(Pose::Identity(), 1e-12));
}

TEST(TrajectoryError, ScaleIsNotCorrected) {
  // A square of side 2 estimated with side 2.2: corners are off by 0.1 * sqrt(2) about the centre.
  const std::vector<Pose> square = {poseAt(0, 0, 0), poseAt(2, 0, 0), poseAt(2, 2, 0),
                                    poseAt(0, 2, 0)};
  const std::vector<Pose> larger = {poseAt(0, 0, 0), poseAt(2.2, 0, 0), poseAt(2.2, 2.2, 0),
                                    poseAt(0, 2.2, 0)};
  const TrajectoryError error = trajectoryError(larger, square);
  EXPECT_NEAR(error.absolute_rms, 0.1 * std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(error.absolute_max, 0.1 * std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(error.relative_translation_rms, 0.2, 1e-12);
  EXPECT_NEAR(error.end_translation, 0.2, 1e-12);
  EXPECT_NEAR(error.endDriftPercent(), 100.0 * 0.2 / 6.0, 1e-12);
}

TEST(TrajectoryError, OneWrongTurnShowsInRotationOnce) {
  // After the second pose the estimate looks 0.1 rad too far left and goes on straight ahead.
  std::vector<Pose> estimate = kBend;
  const Pose turn = kBend[1] * poseAt(0, 0, 0, 0.1) * kBend[1].inverse();
  for (std::size_t i = 1; i < estimate.size(); ++i) estimate[i] = turn * kBend[i];
  const TrajectoryError error = trajectoryError(estimate, kBend);
  EXPECT_NEAR(error.relative_rotation_rms, 0.1 / std::sqrt(4.0), 1e-12);
  EXPECT_NEAR(error.relative_translation_rms, 0.0, 1e-12);
  EXPECT_NEAR(error.end_rotation, 0.1, 1e-12);
  // The chord of 0.1 rad over the sqrt(1 + 4) m between the second and the last position, seen
  // from above.
  EXPECT_NEAR(error.end_translation, 2.0 * std::sin(0.05) * std::sqrt(5.0), 1e-12);
}

TEST(TrajectoryError, StraightPathIsLaidOnByItsFirstPose) {
  std::vector<Pose> straight;
  std::vector<Pose> estimate;
  for (int i = 0; i < 11; ++i) {
    straight.push_back(poseAt(0.1 * i, 0, 0));
    estimate.push_back(poseAt(7.0, 0.1 * i * 1.02, 1.0, M_PI / 2.0));
  }
  const TrajectoryError error = trajectoryError(estimate, straight);
  EXPECT_NEAR(error.end_translation, 0.02, 1e-12);
  EXPECT_NEAR(error.endDriftPercent(), 2.0, 1e-9);
  EXPECT_NEAR(error.absolute_max, 0.02, 1e-12);
}

TEST(TrajectoryError, CameraAtRestHasNoDriftInPercent) {
  const std::vector<Pose> still(4, poseAt(1, 2, 3));
  const TrajectoryError error = trajectoryError(still, still);
  EXPECT_EQ(error.path_length, 0.0);
  EXPECT_EQ(error.endDriftPercent(), 0.0);
}

TEST(TrajectoryError, FewPosesGiveNumbersToo) {
  EXPECT_EQ(trajectoryError({}, {}).poses, 0u);
  const TrajectoryError one = trajectoryError({poseAt(1, 0, 0)}, {poseAt(0, 0, 0)});
  EXPECT_EQ(one.poses, 1u);
  EXPECT_NEAR(one.absolute_rms, 0.0, 1e-12);
}

TEST(TrajectoryError, RefusesWhatCannotBeCompared) {
  EXPECT_THROW(trajectoryError({poseAt(0, 0, 0)}, {}), InputError);
  std::vector<Pose> bad = kBend;
  bad[2].translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(trajectoryError(bad, kBend), InputError);
  EXPECT_THROW(trajectoryError(kBend, bad), InputError);
}

TEST(TrajectoryError, StaysExactFarFromTheOrigin) {
  std::vector<Pose> far;
  for (const Pose& pose : kBend) far.push_back(poseAt(1e6, 1e6, 0) * pose);
  EXPECT_NEAR(trajectoryError(far, kBend).absolute_rms, 0.0, 1e-6);
}

}  // namespace
}  // namespace planar_mapping
