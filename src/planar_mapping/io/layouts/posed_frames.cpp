// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <optional>
#include <string>
#include <string_view>

#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/text_lines.h"

// RGB-D frames with a file each for the pose: NAME.depth.png, NAME.color.png and NAME.pose.txt in
// one folder (3DMatch, 7-Scenes), or depth/N.png, color/N.jpg, pose/N.txt and
// intrinsic/ (ScanNet). A pose is T_world_camera, four rows of four numbers.
namespace planar_mapping::io::layouts {
namespace {

constexpr std::string_view kDepthEnd = ".depth.png";
const std::string kPoseEnd = ".pose.txt";

/// NAME of NAME.depth.png or depth/NAME.png.
std::string frameNameOf(const std::string& depth_file) {
  return endsWith(depth_file, kDepthEnd) ? stemOf(stemOf(depth_file)) : stemOf(depth_file);
}

/// The number that a name ends with, else \p otherwise.
double numberOf(const std::string& name, std::size_t otherwise) {
  const std::size_t digits = name.find_last_not_of("0123456789") + 1;
  double number = 0.0;
  return digits < name.size() && parseNumber(std::string_view(name).substr(digits), number)
             ? number
             : static_cast<double>(otherwise);
}

/// The first numbers of each of so many rows; not finite where the camera was lost.
Eigen::MatrixXd readMatrix(const std::string& path, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd matrix(rows, columns);
  Eigen::Index row = 0;
  forEachLine(path, "", [&](const Words& words, std::size_t line) {
    if (row == rows) return;
    bool sound = words.size() >= static_cast<std::size_t>(columns);
    for (Eigen::Index i = 0; sound && i < columns; ++i)
      sound = parseNumber(words[static_cast<std::size_t>(i)], matrix(row, i));
    if (!sound) failAtLine(path, line, "needs " + std::to_string(columns) + " numbers");
    ++row;
  });
  if (row < rows) throw IoError(path, "needs " + std::to_string(rows) + " rows of numbers");
  return matrix;
}

/// \param lenient  a faulty one is none
std::optional<Pose> readPose(const std::string& path, bool lenient) {
  try {
    const Eigen::MatrixXd matrix = readMatrix(path, 3, 4);
    if (!matrix.allFinite()) return std::nullopt;
    const std::optional<Pose> pose = poseOf(matrix);
    if (!pose) throw IoError(path, "has no rotation matrix");
    return pose;
  } catch (const IoError&) {
    if (!lenient) throw;
    return std::nullopt;
  }
}

/// Of the depth camera.
Calibration readIntrinsics(const std::string& path, const std::string& depth_file) {
  constexpr double kMillimetres = 1000.0;
  const Eigen::MatrixXd k = readMatrix(path, 2, 3);
  const DepthImage image = readDepthPng(depth_file);
  if (!(k(0, 0) > 0.0 && k(1, 1) > 0.0 && k.allFinite()))
    throw IoError(path, "focal lengths must be numbers > 0, the centre finite");
  const auto width = static_cast<int>(image.width);
  const auto height = static_cast<int>(image.height);
  return depthCalibration({k(0, 0), k(1, 1), k(0, 2), k(1, 2), width, height}, kMillimetres);
}

}  // namespace

bool isScannet(const std::string& folder) {
  return isDirectory(joined(folder, "depth")) && isDirectory(joined(folder, "pose")) &&
         isDirectory(joined(folder, "intrinsic"));
}

bool hasPosedFrames(const std::string& folder) {
  if (isScannet(folder)) return true;
  if (!isDirectory(folder)) return false;
  for (const std::string& file : filesOf(folder))
    if (endsWith(file, kDepthEnd) && exists(joined(folder, frameNameOf(file) + kPoseEnd)))
      return true;
  return false;
}

Description readPosedFrames(const std::string& folder, const SequenceOptions& options) {
  constexpr double kFramesPerSecond = 30.0;
  const bool is_scannet = isScannet(folder);
  Description description(is_scannet ? "ScanNet" : "RGB-D frames with poses", SequenceKind::Rgbd);
  std::size_t without_pose = 0;
  std::size_t all = 0;
  for (const std::string& depth : depthFilesOf(is_scannet ? joined(folder, "depth") : folder)) {
    if (!is_scannet && !endsWith(depth, kDepthEnd)) continue;
    const std::string name = frameNameOf(depth);
    const std::string color =
        is_scannet ? firstOf(folder, {"color/" + name + ".jpg", "color/" + name + ".png"})
                   : firstOf(folder, {name + ".color.png", name + ".color.jpg"});
    const std::string pose_file =
        firstOf(folder, {is_scannet ? "pose/" + name + ".txt" : name + kPoseEnd});
    FrameEntry frame{depth, color, numberOf(name, all) / kFramesPerSecond, {}};
    if (!pose_file.empty() && options.poses_file.empty())
      frame.T_world_sensor = readPose(pose_file, options.ignore_poses);
    ++all;
    description.has_color = description.has_color || !color.empty();
    if (frame.T_world_sensor) description.pose_source = PoseSource::File;
    without_pose += frame.T_world_sensor ? 0 : 1;
    description.frames.push_back(std::move(frame));
  }
  if (all == 0) throw IoError(folder, "holds no depth images");
  if (description.pose_source == PoseSource::File && !options.ignore_poses) {
    dropWithoutPose(description);
    noteLeftOut(without_pose, all, "frames", "they have no pose, or one that is not finite",
                description);
  }
  if (!options.calibration_file.empty()) return description;
  const std::string intrinsics = firstOf(
      folder,
      {"intrinsic/intrinsic_depth.txt", "camera-intrinsics.txt", "../camera-intrinsics.txt"});
  description.calibration = ownCalibration(folder);
  if (!description.calibration && !intrinsics.empty())
    description.calibration = readIntrinsics(intrinsics, description.frames.front().file);
  if (!description.calibration)
    throw IoError(
        folder,
        "the camera is not known: give its calib.yaml (image_width, image_height, fx, fy, "
        "cx, cy, depth_scale) by --calib FILE or put it here; the depth camera of 7-Scenes "
        "has fx = fy = 585, cx = 320, cy = 240, depth_scale 1000");
  return description;
}

}  // namespace planar_mapping::io::layouts
