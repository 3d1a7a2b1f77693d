// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/localization/trajectory_error.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"
#include "planar_mapping/geometry/angles.h"
#include "planar_mapping/localization/odometry/motion_estimation.h"

namespace planar_mapping {
namespace {

/// What the estimate says of the motion from pose i to pose j, after the inverse of what is true.
Pose relativeError(const std::vector<Pose>& estimate, const std::vector<Pose>& reference,
                   std::size_t i, std::size_t j) {
  const Pose estimated = estimate[i].inverse() * estimate[j];
  const Pose real = reference[i].inverse() * reference[j];
  return real.inverse() * estimated;
}

void requireFinite(const std::vector<Pose>& poses, const char* which) {
  for (const Pose& pose : poses) {
    if (!pose.matrix().allFinite())
      throw InputError(std::string("a pose of the ") + which + " trajectory is not finite");
  }
}

Pose alignment(const std::vector<Pose>& estimate, const std::vector<Pose>& reference) {
  std::vector<Vector3> from;
  std::vector<Vector3> to;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    from.push_back(estimate[i].translation());
    to.push_back(reference[i].translation());
  }
  Pose motion;
  if (rigidMotion(from, to, motion)) return motion;
  return reference.front() * estimate.front().inverse();
}

void addAbsolute(const std::vector<Pose>& estimate, const std::vector<Pose>& reference,
                 TrajectoryError& error) {
  double squared = 0.0;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const double distance = (error.T_reference_estimate * Vector3(estimate[i].translation()) -
                             reference[i].translation())
                                .norm();
    squared += distance * distance;
    error.absolute_max = std::max(error.absolute_max, distance);
  }
  error.absolute_rms = std::sqrt(squared / static_cast<double>(estimate.size()));
}

void addSteps(const std::vector<Pose>& estimate, const std::vector<Pose>& reference,
              TrajectoryError& error) {
  if (estimate.size() < 2) return;
  double translation = 0.0;
  double rotation = 0.0;
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    error.path_length += (reference[i].translation() - reference[i - 1].translation()).norm();
    const Pose step = relativeError(estimate, reference, i - 1, i);
    translation += step.translation().squaredNorm();
    rotation += std::pow(rotationAngle(step.linear()), 2);
  }
  const auto steps = static_cast<double>(estimate.size() - 1);
  error.relative_translation_rms = std::sqrt(translation / steps);
  error.relative_rotation_rms = std::sqrt(rotation / steps);
}

}  // namespace

TrajectoryError trajectoryError(const std::vector<Pose>& estimate,
                                const std::vector<Pose>& reference) {
  if (estimate.size() != reference.size())
    throw InputError("the trajectories have " + std::to_string(estimate.size()) + " and " +
                     std::to_string(reference.size()) + " poses");
  requireFinite(estimate, "estimated");
  requireFinite(reference, "reference");
  TrajectoryError error;
  error.poses = estimate.size();
  if (estimate.empty()) return error;
  error.T_reference_estimate = alignment(estimate, reference);
  addAbsolute(estimate, reference, error);
  addSteps(estimate, reference, error);
  const Pose end = relativeError(estimate, reference, 0, estimate.size() - 1);
  error.end_translation = end.translation().norm();
  error.end_rotation = rotationAngle(end.linear());
  return error;
}

}  // namespace planar_mapping
