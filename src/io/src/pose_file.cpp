// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/pose_file.h"

#include <cmath>
#include <functional>

#include "input_file.h"
#include "planar_mapping/core/base/error.h"
#include "text_lines.h"

namespace planar_mapping::io {
namespace {

constexpr std::size_t kLongestLine = 4096;

using Words = std::vector<std::string_view>;

template <std::size_t N>
void parseNumbers(const Words& words, const char* format, double (&v)[N]) {
  if (words.size() != N)
    throw InputError("needs " + std::to_string(N) + " numbers (" + format + "), has " +
                     std::to_string(words.size()));
  for (std::size_t i = 0; i < N; ++i)
    if (!parseNumber(words[i], v[i]) || !std::isfinite(v[i]))
      throw InputError(quoted(words[i]) + " is no finite number");
}

StampedPose parseTumPose(const Words& words) {
  constexpr double kNormTolerance = 1e-3;
  double v[8] = {};
  parseNumbers(words, "timestamp tx ty tz qx qy qz qw", v);
  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1.0) <= kNormTolerance)) {
    throw InputError(concatenated("the quaternion has length ", norm, " instead of 1"));
  }
  StampedPose pose;
  pose.timestamp = v[0];
  pose.pose.linear() = rotation.normalized().toRotationMatrix();
  pose.pose.translation() = Vector3(v[1], v[2], v[3]);
  return pose;
}

StampedPose parseKittiPose(const Words& words, std::size_t number) {
  double v[12] = {};
  parseNumbers(words, "3 x 4 matrix, row by row", v);
  const std::optional<Pose> pose =
      poseOf(Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(v));
  if (!pose) throw InputError("its first three columns are no rotation matrix");
  return {static_cast<double>(number), *pose};
}

void forEachPoseLine(const std::string& path, const std::function<void(const Words&)>& visit) {
  InputFile file(path);
  LineReader lines(file, kLongestLine);
  std::string_view line;
  while (lines.next(line)) {
    const Words words = splitWords(line.substr(0, line.find('#')));
    try {
      if (!words.empty()) visit(words);
    } catch (const InputError& error) {
      failAtLine(path, lines.number(), error.what());
    }
  }
}

}  // namespace

std::vector<StampedPose> readTumPoses(const std::string& path) {
  std::vector<StampedPose> poses;
  forEachPoseLine(path, [&](const Words& words) { poses.push_back(parseTumPose(words)); });
  return poses;
}

Trajectory readTrajectory(const std::string& path) {
  Trajectory trajectory;
  std::vector<StampedPose>& poses = trajectory.poses;
  forEachPoseLine(path, [&](const Words& words) {
    if (poses.empty()) trajectory.has_times = words.size() != 12;
    poses.push_back(trajectory.has_times ? parseTumPose(words)
                                         : parseKittiPose(words, poses.size()));
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
