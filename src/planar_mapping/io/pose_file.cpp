// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/pose_file.h"

#include <cmath>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io {
namespace {

/// Exactly as many finite numbers as there are in \p v.
template <std::size_t N>
void readNumbers(const Words& words, const char* format, double (&v)[N], const std::string& path,
                 std::size_t line) {
  if (words.size() != N)
    failAtLine(path, line,
               "needs " + std::to_string(N) + " numbers (" + format + "), has " +
                   std::to_string(words.size()));
  finiteNumbers(words, 0, v, N, path, line);
}

StampedPose readTumPose(const Words& words, const std::string& path, std::size_t line) {
  constexpr double kNormTolerance = 1e-3;
  double v[8] = {};
  readNumbers(words, "timestamp tx ty tz qx qy qz qw", v, path, line);
  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1.0) <= kNormTolerance))
    failAtLine(path, line, concatenated("the quaternion has length ", norm, " instead of 1"));
  return {v[0], poseOf(Vector3(v[1], v[2], v[3]), rotation)};
}

Pose readKittiPose(const Words& words, const std::string& path, std::size_t line) {
  double v[12] = {};
  readNumbers(words, "3 x 4 matrix, row by row", v, path, line);
  const std::optional<Pose> pose =
      poseOf(Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(v));
  if (!pose) failAtLine(path, line, "its first three columns are no rotation matrix");
  return *pose;
}

}  // namespace

std::vector<StampedPose> readTumPoses(const std::string& path) {
  std::vector<StampedPose> poses;
  forEachLine(path, "", [&](const Words& words, std::size_t line) {
    poses.push_back(readTumPose(words, path, line));
  });
  return poses;
}

Trajectory readTrajectory(const std::string& path) {
  Trajectory trajectory;
  std::vector<StampedPose>& poses = trajectory.poses;
  forEachLine(path, "", [&](const Words& words, std::size_t line) {
    if (poses.empty()) trajectory.has_times = words.size() != 12;
    if (trajectory.has_times) {
      poses.push_back(readTumPose(words, path, line));
    } else {
      poses.push_back({static_cast<double>(poses.size()), readKittiPose(words, path, line)});
    }
  });
  return trajectory;
}

std::string toTum(const std::vector<StampedPose>& poses) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (const StampedPose& stamped : poses) {
    requirePose(stamped.pose, concatenated("time ", stamped.timestamp));
    if (!std::isfinite(stamped.timestamp)) throw InputError("the time of a pose is not finite");
    const Eigen::Quaterniond q(Eigen::Matrix3d(stamped.pose.linear()));
    const Vector3 t = stamped.pose.translation();
    append(text, stamped.timestamp, ' ', listOf(t), ' ', listOf(Quaternion(q)), '\n');
  }
  return text;
}

void writeTumPoses(const std::string& path, const std::vector<StampedPose>& poses,
                   Overwrite overwrite) {
  writeFileAtomically(path, toTum(poses), overwrite);
}

}  // namespace planar_mapping::io
