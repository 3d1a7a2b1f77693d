// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/motion/motion_keys.h"

#include <cmath>

#include "planar_mapping/ground/ground.h"
#include "planar_mapping/ground/up.h"
#include "planar_mapping/pipeline/rounded.h"

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
  const Upright upright = findUpright(planesFor(pointsOf(*frame.cloud), noise),
                                      pose.linear().transpose() * Vector3::UnitZ());
  if (!upright.found) return;
  setUpright(upright.up, pose);
  const double tilt_deg = upright.tilt * 180.0 / M_PI;
  const std::string note = frame.source + ": the planes seen say that the sensor is tilted by " +
                           rounded(tilt_deg, 1) + " degrees; the world is level by them";
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

void MotionKeys::declare(ParameterTable& table) {
  table.word("poses", poses,
             {{"use", Poses::Use}, {"prior", Poses::Prior}, {"ignore", Poses::Ignore}},
             "given poses are taken as they are, as a prior, or not at all; frames without one "
             "are placed by what they show");
  start.declare(table);
  table.number("given_position_error_m", given_position_error, Range::positive(),
               "[ours] of given poses");
  table.number("given_orientation_error_deg", given_orientation_error, Range::above(0.0, 180.0),
               "[ours] of given poses");
  noise.declareOptional(table, "depth error of images by the stereo noise");
  table.number("pixel_error_px", localizer.noise.pixel, Range::positive(),
               "[ours] of a feature's column and row");
  table.number("min_log_odds", localizer.min_log_odds, Range::between(-10.0, 10.0),
               "[ours] of images: a pose is taken where right is likelier than wrong by e to the "
               "power of this; where it is not, the frame begins a submap of its own");
  table.number("keyframe_overlap", localizer.keyframe_overlap, Range::between(0.0, 1.0),
               "[ours] a frame that shares less with the nearest keyframe becomes one");
  table.number("depth_error_m", depth_error, Range::atLeast(0.0),
               "[ours] of clouds without images: depth error near the sensor; auto = 0.003 of a "
               "camera, 0.02 of a scanner");
  table.number("depth_error_growth", depth_error_growth, Range::atLeast(0.0),
               "[ours] without stereo noise: depth error per square of depth, 1/m; auto = 0.003 of "
               "images, 0.002 of a camera without, 0.001 of a scanner");
  table.number("cloud_cell_m", cloud_cell, Range::positive(),
               "[ours] side of the cells of the surfaces that clouds without images are "
               "registered to; auto = 0.05, or the least multiple by "
               "2, 4, 8 or 16 with which half of the first cloud's points lie on planes of cells");
  table.number("cloud_reach_m", cloud_reach, Range::positive(),
               "[ours] from how far a cloud is drawn to them; auto = 6 cells");
  table.number("cloud_search_reach_m", surface.search_reach, Range::atLeast(0.0),
               "[ours] from how far, and turned anyhow, it is looked for where it is not found "
               "near; 0 = it is not");
  table.number("cloud_max_seen_through", surface.max_seen_through, Range::between(0.0, 1.0),
               "[ours] fraction of the cells that may be seen through where the cloud is put");
  table.number("cloud_min_fraction", cloud_min_fraction, Range::between(0.0, 1.0),
               "[ours] of the cloud's cells that must lie on them; auto = 0.4 of a camera, 0.3 of "
               "a scanner");
  table.basic({"poses", "start", "camera_height_m"});
}

void MotionKeys::configure() {
  adapt(true);
  localizer.validate();
  surface.validate();
}

void MotionKeys::adapt(bool is_optical) {
  const SurfaceMapParams suitable = is_optical ? SurfaceMapParams() : SurfaceMapParams::ofScanner();
  surface.optical_axis = suitable.optical_axis;
  surface.depth_error = depth_error.value_or(suitable.depth_error);
  surface.depth_error_growth = depth_error_growth.value_or(suitable.depth_error_growth);
  surface.min_fraction = cloud_min_fraction.value_or(suitable.min_fraction);
}

LocalizerParams MotionKeys::localizerNow() const {
  LocalizerParams params = localizer;
  if (const std::optional<StereoNoise> known = noise.optionalNoise()) {
    params.noise = SensorNoise::ofPair(known->focal_length, known->baseline);
    params.noise.pixel = localizer.noise.pixel;
  } else if (depth_error_growth) {
    params.noise.inverse_depth = *depth_error_growth;
  }
  return params;
}

SurfaceMapParams MotionKeys::surfaceFor(const Frame& frame) const {
  constexpr double kReachInCells = 6.0;
  SurfaceMapParams params = surface;
  params.cell = cloud_cell ? *cloud_cell : surfaceCellFor(pointsOf(*frame.cloud), surface);
  params.reach = cloud_reach.value_or(kReachInCells * params.cell);
  return params;
}

}  // namespace planar_mapping::detail
