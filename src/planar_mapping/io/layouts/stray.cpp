// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/text_lines.h"

// Stray Scanner, of telephones with a laser: depth/N.png in millimetres, confidence/N.png,
// camera_matrix.csv of the video's images and odometry.csv. The video (rgb.mp4) is not read.
namespace planar_mapping::io::layouts {
namespace {

/// Of the video's images, brought to those of depth.
Calibration readCamera(const std::string& path, const DepthImage& depth) {
  constexpr double kWidth = 1920.0;
  constexpr double kHeight = 1440.0;
  std::vector<Vector3> rows;
  forEachLine(path, ",", [&](const Words& words, std::size_t line) {
    rows.emplace_back();
    finiteNumbers(words, 0, rows.back().data(), 3, path, line);
  });
  if (rows.size() != 3 || !(rows[0][0] > 0.0) || !(rows[1][1] > 0.0))
    throw IoError(path, "is no camera matrix: three rows of three numbers");
  if (!(std::abs(rows[0][2] - 0.5 * kWidth) < 0.1 * kWidth &&
        std::abs(rows[1][2] - 0.5 * kHeight) < 0.1 * kHeight))
    throw IoError(path, "is not of images of 1920 x 1440: give a calibration of the depth images");
  const double across = depth.width / kWidth;
  const double down = depth.height / kHeight;
  const PinholeCamera camera = {across * rows[0][0],
                                down * rows[1][1],
                                across * (rows[0][2] + 0.5) - 0.5,
                                down * (rows[1][2] + 0.5) - 0.5,
                                static_cast<int>(depth.width),
                                static_cast<int>(depth.height)};
  return depthCalibration(camera, 1000.0);
}

/// "timestamp, frame, x, y, z, qx, qy, qz, qw" and more, a line a frame.
std::map<std::string, StampedPose> readOdometry(const std::string& path) {
  std::map<std::string, StampedPose> frames;
  forEachLine(path, ",", [&](const Words& words, std::size_t line) {
    if (words.front() == "timestamp") return;
    if (words.size() < 9) failAtLine(path, line, "is cut short");
    double v[7];
    finiteNumbers(Words(words.begin(), words.begin() + 9), 2, v, 7, path, line);
    const double timestamp = finiteNumber(words[0], path, line);
    const Eigen::Quaterniond turn(v[6], v[3], v[4], v[5]);
    if (!(std::abs(turn.norm() - 1.0) <= 1e-2))
      failAtLine(path, line, "the quaternion is not of length 1");
    frames[std::string(words[1])] = {timestamp, poseOf(Vector3(v[0], v[1], v[2]), turn)};
  });
  return frames;
}

}  // namespace

bool hasStray(const std::string& folder) {
  return isDirectory(joined(folder, "depth")) && exists(joined(folder, "odometry.csv")) &&
         exists(joined(folder, "camera_matrix.csv"));
}

Description readStray(const std::string& folder, const SequenceOptions& options) {
  Description description("Stray Scanner", SequenceKind::Rgbd);
  const std::vector<std::string> depths = depthFilesOf(joined(folder, "depth"));
  if (options.calibration_file.empty())
    description.calibration =
        readCamera(joined(folder, "camera_matrix.csv"), readDepthPng(depths.front()));
  const std::map<std::string, StampedPose> odometry = readOdometry(joined(folder, "odometry.csv"));
  const std::string confidence = joined(folder, "confidence");
  const FilesByName confidences =
      isDirectory(confidence) ? imagesByName(confidence) : FilesByName();
  for (const std::string& file : depths) {
    const auto one = odometry.find(stemOf(file));
    if (one == odometry.end()) continue;
    FrameEntry frame{file, {}, one->second.timestamp, {}};
    if (options.poses_file.empty()) frame.T_world_sensor = one->second.pose;
    frame.confidence = fileOf(confidences, stemOf(file));
    description.frames.push_back(frame);
  }
  if (description.frames.empty())
    throw IoError(folder, "odometry.csv has no frame that depth/ has");
  noteLeftOut(depths.size() - description.frames.size(), depths.size(), "depth images",
              "odometry.csv does not have them", description);
  if (options.poses_file.empty()) description.pose_source = PoseSource::File;
  return description;
}

}  // namespace planar_mapping::io::layouts
