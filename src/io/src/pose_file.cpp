// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/pose_file.h"

#include <cmath>

#include "input_file.h"
#include "number_text.h"
#include "planar_mapping/core/base/error.h"
#include "text_lines.h"

namespace planar_mapping {
namespace io {
namespace {

constexpr std::size_t kLongestLine = 4096;

StampedPose parsePose(const std::string& path, std::size_t number,
                      const std::vector<std::string_view>& words, double norm_tolerance) {
  const auto fail = [&](const std::string& problem) {
    throw IoError(path, "line " + std::to_string(number) + ": " + problem);
  };
  if (words.size() != 8)
    fail("needs 8 numbers (timestamp tx ty tz qx qy qz qw), has " + std::to_string(words.size()));
  double v[8] = {};
  for (std::size_t i = 0; i < 8; ++i)
    if (!parseNumber(words[i], v[i]) || !std::isfinite(v[i]))
      fail(quoted(words[i]) + " is no finite number");
  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1.0) <= norm_tolerance)) {
    std::string length;
    appendNumber(length, norm);
    fail("the quaternion has length " + length + " instead of 1");
  }
  StampedPose pose;
  pose.timestamp = v[0];
  pose.pose.linear() = rotation.normalized().toRotationMatrix();
  pose.pose.translation() = Vector3(v[1], v[2], v[3]);
  return pose;
}

}  // namespace

std::vector<StampedPose> readTumPoses(const std::string& path, double norm_tolerance) {
  InputFile file(path);
  LineReader lines(file, kLongestLine);
  std::vector<StampedPose> poses;
  std::string_view line;
  while (lines.next(line)) {
    const std::vector<std::string_view> words = splitWords(line.substr(0, line.find('#')));
    if (words.empty()) continue;
    poses.push_back(parsePose(path, lines.number(), words, norm_tolerance));
  }
  return poses;
}

std::string toTum(const std::vector<StampedPose>& poses) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (const StampedPose& stamped : poses) {
    const Eigen::Quaterniond q(Eigen::Matrix3d(stamped.pose.linear()));
    const Vector3 t = stamped.pose.translation();
    const double values[] = {stamped.timestamp, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
    for (const double value : values) {
      appendNumber(text, value);
      text += ' ';
    }
    text.back() = '\n';
  }
  return text;
}

void writeTumPoses(const std::string& path, const std::vector<StampedPose>& poses,
                   Overwrite overwrite) {
  writeFileAtomically(path, toTum(poses), overwrite);
}

}  // namespace io
}  // namespace planar_mapping
