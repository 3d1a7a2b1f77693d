// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/motion/given_poses.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/pipeline/rounded.h"

namespace planar_mapping::detail {
namespace {

// How far poses may be apart that say the same.
constexpr double kShift = 0.1;         // metres, and
constexpr double kShiftOfStep = 0.05;  // metres a metre of the step
constexpr double kAgreeingTurn = M_PI / 36.0;  // radians

constexpr const char* kUnknownCause =
    "; are images, depths, poses and calibration of one camera, in one order?";

bool agree(const Pose& a, const Pose& b, double step) {
  const Pose apart = a.inverse() * b;
  return apart.translation().norm() < kShift + kShiftOfStep * step &&
         rotationAngle(apart.linear()) < kAgreeingTurn;
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
      apart.translation().norm() < kMaxDifference * length && rotationAngle(apart.linear()) < kAgreeingTurn;
  return is_scaled && agrees ? std::optional(scale) : std::nullopt;
}

/// What else the poses may be, if that agrees with what is seen of one step.
std::string otherConvention(const Pose& last, const Pose& given, const Pose& seen) {
  const double step = (last.translation() - given.translation()).norm();
  const bool differs = !agree(given, seen, step);
  Pose half_turn = Pose::Identity();
  half_turn.linear() = Vector3(1.0, -1.0, -1.0).asDiagonal();
  const bool is_turned =
      differs && agree(last * half_turn * (last.inverse() * given) * half_turn, seen, step);
  const bool is_inverse = differs && agree(last * (last * given.inverse()), seen, step);
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

constexpr std::size_t kFewest = 20;  // features that tell

PosePrior exactly(const Pose& pose) {
  return {pose, Matrix6::Identity(), true};
}

bool mostlyElsewhere(const OdometryResult& at_given) {
  constexpr double kDisagreement = 0.3;  // of the features: so few agree with the given pose
  return static_cast<double>(at_given.inliers) <=
         kDisagreement * static_cast<double>(at_given.matches);
}

/// Where features put a frame, if that is far better than its given pose.
std::optional<OdometryResult> seenElsewhere(const Frame& frame, const Odometry& odometry,
                                            const OdometryResult& at_given) {
  const OdometryResult seen = odometry.locate(frame.key_features);
  const bool told = mostlyElsewhere(at_given) && seen.registered &&
                    seen.inliers >= std::max(kFewest, 2 * at_given.inliers);
  return told ? std::optional(seen) : std::nullopt;
}

}  // namespace

std::optional<std::string> GivenPoses::contradictionOf(const Frame& frame,
                                                       const FrameLocator& locator) {
  if (contradicted) return std::nullopt;
  std::optional<std::string> warning = standstillOf(frame, locator);
  if (!warning) warning = offsetOf(frame, locator.odometry());
  contradicted = warning.has_value();
  before.reset();
  if (contradicted) return warning;
  before.emplace(locator.odometry().params());
  before->update(frame.key_features, exactly(*frame.given_pose));
  given_before = *frame.given_pose;
  return std::nullopt;
}

/// Hardly a feature is where it was in the frame before, which has the same pose, and the views do
/// not agree: people who walk by leave features of the room, a bare wall leaves the view.
std::optional<std::string> GivenPoses::standstillOf(const Frame& frame,
                                                    const FrameLocator& locator) {
  constexpr double kStay = 0.1;       // of the features
  constexpr std::int32_t kSteps = 2;  // in a row
  const Pose& pose = *frame.given_pose;
  if (!before || pose.matrix() != given_before.matrix()) still_since = frame.number;
  bool moves = before && still_since != frame.number;
  if (moves) {
    const OdometryResult stays = before->locate(frame.key_features, exactly(pose));
    moves = std::min(stays.features, before->landmarks()) >= kFewest &&
            static_cast<double>(stays.inliers) < kStay * static_cast<double>(stays.features) &&
            locator.isRefused(pose);
  }
  moving = moves ? moving + 1 : 0;
  if (moving < kSteps) return std::nullopt;
  return "the given poses of frames " + std::to_string(still_since) + " to " +
         std::to_string(frame.number) + " " + frame.source +
         " are the same, but what is seen moves: are they poses of this camera?";
}

std::optional<std::string> GivenPoses::offsetOf(const Frame& frame, const Odometry& odometry) {
  if (!odometry.started()) return std::nullopt;
  const Pose& pose = *frame.given_pose;
  const OdometryResult at_given = odometry.locate(frame.key_features, exactly(pose));
  if (at_given.matches < kFewest) return std::nullopt;
  if (!mostlyElsewhere(at_given)) {
    ++agreed;
    return std::nullopt;
  }
  const auto seen = seenElsewhere(frame, odometry, at_given);
  const double length = before ? (given_before.translation() - pose.translation()).norm() : 0.0;
  if (!seen || agree(pose, seen->T_world_sensor, length)) return std::nullopt;
  const Pose apart = pose.inverse() * seen->T_world_sensor;
  return "frame " + std::to_string(frame.number) + " " + frame.source +
         ": its given pose contradicts the images: " + std::to_string(seen->inliers) + " of " +
         std::to_string(seen->matches) + " known features put it " +
         rounded(apart.translation().norm(), 2) + " m and " +
         rounded(rotationAngle(apart.linear()) * 180.0 / M_PI, 2) + " degrees elsewhere" +
         causeOf(frame);
}

/// By the step from the frame before alone: where the map is, poses that went wrong have added up.
std::string GivenPoses::causeOf(const Frame& frame) const {
  constexpr std::int32_t kSure = 5;  // poses of another convention do not agree so often
  constexpr double kMost = 0.7;      // of the features: fewer may be off by a third of a step
  const Pose& pose = *frame.given_pose;
  if (before && pose.matrix() == given_before.matrix()) return "; it is that of the frame before";
  if (!before || agreed >= kSure) return kUnknownCause;
  const auto seen =
      seenElsewhere(frame, *before, before->locate(frame.key_features, exactly(pose)));
  const bool sure =
      seen && static_cast<double>(seen->inliers) >= kMost * static_cast<double>(seen->matches);
  return sure ? otherConvention(given_before, pose, seen->T_world_sensor) : kUnknownCause;
}

}  // namespace planar_mapping::detail
