// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "layouts/folder.h"
#include "layouts/layout.h"
#include "planar_mapping/core/base/error.h"

// ICL-NUIM, "TUM RGB-D compatible PNGs": depth/N.png and rgb/N.png, with or without
// associations.txt, and poses in NAME.gt.freiburg with numbers of frames as times.
namespace planar_mapping::io::layouts {
namespace {

/// NAME.gt.freiburg, or "".
std::string posesOf(const std::string& folder) {
  for (const std::string& file : filesOf(folder))
    if (endsWith(file, ".gt.freiburg")) return file;
  return "";
}

void listImages(const std::string& folder, Description& description) {
  const std::vector<std::string> depths = depthFilesOf(joined(folder, "depth"));
  const FilesByName colors = imagesByName(joined(folder, "rgb"));
  for (const std::string& file : depths) {
    const auto color = colors.find(stemOf(file));
    if (color == colors.end()) continue;
    const double number = finiteNumber(stemOf(file), file, 0);
    description.frames.push_back({file, color->second, number, {}});
  }
  if (description.frames.empty())
    throw IoError(folder, "depth/ and rgb/ have no file name in common");
  noteLeftOut(depths.size() - description.frames.size(), depths.size(), "depth images",
              "no colour image of their name", description);
}

}  // namespace

bool hasIcl(const std::string& folder) {
  return isDirectory(joined(folder, "depth")) && isDirectory(joined(folder, "rgb")) &&
         !posesOf(folder).empty();
}

Description readIcl(const std::string& folder, const SequenceOptions& options) {
  constexpr double kFramesPerSecond = 30.0;
  Description description;
  description.layout = "ICL-NUIM";
  description.kind = SequenceKind::Rgbd;
  description.has_color = true;
  listImages(folder, description);
  Calibration calibration;
  calibration.camera = {481.2, 480.0, 319.5, 239.5, 640, 480};
  calibration.cx_right = calibration.camera.cx;
  calibration.depth_scale = 5000.0;
  description.calibration = calibration;
  if (options.poses_file.empty()) {
    // The data set has fy = -480: its camera and world are left-handed. Mirrored in y, both are
    // right-handed, and the camera's y axis is down.
    std::vector<StampedPose> poses = readTumPoses(posesOf(folder));
    const Vector3 mirror(1.0, -1.0, 1.0);
    for (StampedPose& stamped : poses) {
      stamped.pose.linear() =
          mirror.asDiagonal() * Matrix3(stamped.pose.linear()) * mirror.asDiagonal();
      stamped.pose.translation() = mirror.cwiseProduct(stamped.pose.translation());
    }
    addPosesByTime(posesOf(folder), poses, Pose::Identity(), options, description);
  }
  for (FrameEntry& frame : description.frames) *frame.timestamp /= kFramesPerSecond;
  return description;
}

}  // namespace planar_mapping::io::layouts
