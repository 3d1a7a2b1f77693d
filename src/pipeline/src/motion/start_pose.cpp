// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "motion/start_pose.h"

#include <cmath>

#include "planar_mapping/core/ground/detail/upright.h"
#include "planar_mapping/core/ground/ground.h"

namespace planar_mapping::detail {
namespace {

/// World coordinates of the sensor's axes where it stands upright.
Matrix3 levelAxes(bool optical) {
  if (!optical) return Matrix3::Identity();
  Matrix3 axes;  // columns: x right, y down, z forward; the world has x forward, y left, z up
  axes << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return axes;
}

/// Turns a pose by the smallest angle that makes a direction of the sensor's frame upwards.
void setUpright(const Vector3& up, Pose& pose) {
  const Vector3 now = pose.linear() * up;
  pose.linear() =
      Eigen::Quaterniond::FromTwoVectors(now, Vector3::UnitZ()).toRotationMatrix() * pose.linear();
}

}  // namespace

void StartPose::declare(ParameterTable& table) {
  table.word("start", start_,
             {{"auto", Start::Auto},
              {"level", Start::Level},
              {"identity", Start::Identity},
              {"given", Start::Given},
              {"ground", Start::Ground}},
             "[ours] first pose where none is used: upright by the planes the first frame sees "
             "(level where they do not tell), camera level, at the origin of the world, as given, "
             "or upright over the ground it sees");
  table.number("camera_height_m", camera_height_, Range::atLeast(0.0),
               "height of the sensor over the ground at the start");
}

Pose StartPose::of(Frame& frame, bool optical, const std::optional<StereoNoise>& noise) const {
  if (start_ == Start::Identity) return Pose::Identity();
  if (start_ == Start::Given) {
    if (frame.given_pose) return *frame.given_pose;
    frame.notes.push_back(frame.source + ": no pose is given to start from; starting level");
  }
  Pose pose = Pose::Identity();
  pose.linear() = levelAxes(optical);
  pose.translation().z() = camera_height_;
  if (start_ == Start::Auto) levelByPlanes(frame, noise, pose);
  if (start_ == Start::Ground) levelByGround(frame, optical, noise, pose);
  return pose;
}

/// Turns the pose so that what looks like floors and walls is horizontal and vertical.
void StartPose::levelByPlanes(Frame& frame, const std::optional<StereoNoise>& noise,
                              Pose& pose) const {
  if (!frame.cloud) return;
  const Upright upright =
      findUpright(pointsOf(*frame.cloud), noise, pose.linear().transpose() * Vector3::UnitZ());
  if (!upright.found) return;
  setUpright(upright.up, pose);
  const double tilt_deg = upright.tilt * 180.0 / M_PI;
  const std::string note = frame.source + ": the planes seen say that the sensor is tilted by " +
                           formatNumber(std::round(10.0 * tilt_deg) / 10.0) +
                           " degrees; the world is level by them";
  constexpr double kSteep = 40.0;  // a camera that looks up at a ceiling may see the same
  if (upright.is_uncertain) {
    frame.warnings.push_back(note +
                             " if what it looks at is a wall; if it is a floor or a table, begin "
                             "with a frame that sees more (--frames) or give poses");
  } else if (tilt_deg > kSteep) {
    frame.warnings.push_back(note + " if it looks down; if it looks up, take start=level");
  } else {
    frame.notes.push_back(note);
  }
}

/// Turns the pose so that the ground the frame sees is level and at z = 0.
void StartPose::levelByGround(Frame& frame, bool optical, const std::optional<StereoNoise>& noise,
                              Pose& pose) const {
  GroundParams ground_params;
  ground_params.camera_height = camera_height_;
  ground_params.up = pose.linear().transpose() * Vector3::UnitZ();
  ground_params.optical_axis = optical ? Vector3::UnitZ() : Vector3::UnitX();
  ground_params.noise = noise;
  const Ground ground =
      frame.cloud ? findGround(pointsOf(*frame.cloud), nullptr, ground_params) : Ground();
  if (!ground.found) {
    frame.warnings.push_back(frame.source + ": no ground to level the start pose by (" +
                             toString(ground.diagnostics.status) + "); starting level");
    return;
  }
  setUpright(ground.plane.normal, pose);
  pose.translation().z() = ground.height;
}

}  // namespace planar_mapping::detail
