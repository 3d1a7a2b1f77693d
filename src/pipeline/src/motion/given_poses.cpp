// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "motion/given_poses.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "planar_mapping/core/geometry/detail/angles.h"
#include "rounded.h"

namespace planar_mapping::detail {
namespace {

// How far poses may be apart that say the same.
constexpr double kShift = 0.1;         // metres, and
constexpr double kShiftOfStep = 0.05;  // metres a metre of the step
constexpr double kTurn = M_PI / 36.0;  // radians

constexpr const char* kUnknownCause =
    "; are images, depths, poses and calibration of one camera, in one order?";

bool agree(const Pose& a, const Pose& b, double step) {
  const Pose apart = a.inverse() * b;
  return apart.translation().norm() < kShift + kShiftOfStep * step &&
         rotationAngle(apart.linear()) < kTurn;
}

/// How many times the length of the given step that of the seen one is; nothing where they differ
/// in more than that.
std::optional<double> scaleOf(const Pose& given_step, const Pose& seen_step) {
  constexpr double kSameScale = 1.5;      // below, rather a pose that is off
  constexpr double kMaxDifference = 0.2;  // of the length: 11 degrees
  const double length = seen_step.translation().norm();
  const double scale = length / given_step.translation().norm();
  Pose scaled = given_step;
  scaled.translation() *= scale;
  const Pose apart = scaled.inverse() * seen_step;
  const bool is_scaled = std::max(scale, 1.0 / scale) > kSameScale;
  const bool agrees =
      apart.translation().norm() < kMaxDifference * length && rotationAngle(apart.linear()) < kTurn;
  return is_scaled && agrees ? std::optional(scale) : std::nullopt;
}

/// What else the poses may be, if that agrees with what is seen.
std::string otherConvention(const Pose& last, const Pose& given, const Pose& seen, double step) {
  Pose half_turn = Pose::Identity();
  half_turn.linear() = Vector3(1.0, -1.0, -1.0).asDiagonal();
  const bool is_turned = agree(last * half_turn * (last.inverse() * given) * half_turn, seen, step);
  const bool is_inverse = agree(last * (last * given.inverse()), seen, step);
  const std::string turned =
      "of a camera that looks along -z, y up (OpenGL; turn each by 180 "
      "degrees about x)";
  const std::string inverse = "of the world in the camera's frame (give their inverses)";
  if (is_turned || is_inverse)
    return "; they agree as poses " + (is_turned ? turned : "") +
           (is_turned && is_inverse ? ", or " : "") + (is_inverse ? inverse : "");
  if (const auto scale = scaleOf(last.inverse() * given, last.inverse() * seen))
    return "; they agree but for the length of the step, " + rounded(*scale, 2) +
           " times that of the poses: depth_scale or baseline_m is wrong, or the poses' unit";
  return kUnknownCause;
}

}  // namespace

std::optional<std::string> GivenPoses::contradictionOf(const Frame& frame, const Odometry& odometry,
                                                       const std::optional<Pose>& last) {
  constexpr std::size_t kFewest = 20;    // features,
  constexpr double kDisagreement = 0.3;  // of which so few agree with it
  constexpr std::int32_t kSure = 5;      // poses of another convention do not agree so often
  if (contradicted || !odometry.started()) return std::nullopt;
  const PosePrior prior{*frame.given_pose, Matrix6::Identity(), true};
  const OdometryResult given = odometry.locate(frame.key_features, prior);
  if (given.matches < kFewest) return std::nullopt;
  if (static_cast<double>(given.inliers) > kDisagreement * static_cast<double>(given.matches)) {
    ++agreed;
    return std::nullopt;
  }
  const OdometryResult seen = odometry.locate(frame.key_features);
  if (!seen.registered || seen.inliers < std::max(kFewest, 2 * given.inliers)) return std::nullopt;
  const Pose apart = frame.given_pose->inverse() * seen.T_world_sensor;
  const double step = last ? (last->translation() - frame.given_pose->translation()).norm() : 0.0;
  if (agree(*frame.given_pose, seen.T_world_sensor, step)) return std::nullopt;
  contradicted = true;
  const std::string cause = agreed < kSure
                                ? otherConvention(last.value_or(*frame.given_pose),
                                                  *frame.given_pose, seen.T_world_sensor, step)
                                : kUnknownCause;
  return "frame " + std::to_string(frame.number) + " " + frame.source +
         ": its given pose contradicts the images: " + std::to_string(seen.inliers) + " of " +
         std::to_string(seen.matches) + " known features put it " +
         rounded(apart.translation().norm(), 2) + " m and " +
         rounded(rotationAngle(apart.linear()) * 180.0 / M_PI, 2) + " degrees elsewhere" + cause;
}

}  // namespace planar_mapping::detail
