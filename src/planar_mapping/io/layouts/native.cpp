// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping::io::layouts {
namespace {

void readClouds(const std::string& folder, Description& description) {
  const std::string clouds = joined(folder, "clouds");
  for (const std::string& file : cloudFilesOf(clouds))
    description.frames.push_back({file, {}, {}, {}});
  if (description.frames.empty()) throw IoError(clouds, "holds no PCD or PLY files");
  description.pose_source = PoseSource::Viewpoint;
}

void readRgbd(const std::string& folder, Description& description) {
  FilesByName depths = byName(depthFilesOf(joined(folder, "depth")));
  const std::string rgb = joined(folder, "rgb");
  description.has_color = isDirectory(rgb);
  FilesByName colors = description.has_color ? imagesByName(rgb) : FilesByName();
  matchNames(depths, colors);
  const std::size_t pairs = listFiles(depths, colors, description);
  if (description.has_color && pairs == 0)
    throw IoError(folder, "rgb/ (" + std::to_string(colors.size()) + " images) and depth/ (" +
                              std::to_string(description.frames.size()) +
                              ") do not match by file name or number");
}

void readStereo(const std::string& folder, Description& description) {
  const std::string left = joined(folder, "left");
  const std::string right = joined(folder, "right");
  if (!isDirectory(right)) throw IoError(right, "no such directory; a stereo sequence needs it");
  FilesByName left_images = imagesByName(left);
  FilesByName right_images = imagesByName(right);
  const std::size_t pairs = matchNames(left_images, right_images);
  FilesByName all = left_images;
  all.insert(right_images.begin(), right_images.end());
  for (const auto& entry : all) {
    std::string left_file = fileOf(left_images, entry.first);
    // A missing left image has the name it should have: the frame keeps its place.
    if (left_file.empty())
      left_file = joined(left, entry.second.substr(entry.second.rfind('/') + 1));
    description.frames.push_back({left_file, fileOf(right_images, entry.first), {}, {}});
  }
  if (pairs == 0)
    throw IoError(folder, "left/ (" + std::to_string(left_images.size()) + " images) and right/ (" +
                              std::to_string(right_images.size()) +
                              ") have no file name or number in common (PNG, JPEG, PGM or PPM)");
}

}  // namespace

bool hasNative(const std::string& folder) {
  for (const char* part : {"clouds", "left", "right", "depth"})
    if (isDirectory(joined(folder, part))) return true;
  return exists(joined(folder, "calib.yaml"));
}

Description readNative(const std::string& folder, const SequenceOptions& options) {
  const std::optional<Calibration> own = ownCalibration(folder);
  std::vector<SequenceKind> kinds;
  if (isDirectory(joined(folder, "clouds"))) kinds.push_back(SequenceKind::Clouds);
  if (isDirectory(joined(folder, "depth"))) kinds.push_back(SequenceKind::Rgbd);
  if (isDirectory(joined(folder, "left"))) kinds.push_back(SequenceKind::Stereo);
  if (kinds.empty()) {
    if (isDirectory(joined(folder, "right")))
      throw IoError(folder, "has right/ but no left/, which a stereo sequence needs");
    throw IoError(folder, "has a calib.yaml, but neither clouds/ nor depth/ nor left/ and right/" +
                              adviceOnFiles(folder));
  }
  const bool has_preferred =
      options.preferred && std::find(kinds.begin(), kinds.end(), *options.preferred) != kinds.end();
  Description description("sequence folder", has_preferred ? *options.preferred : kinds.front());
  description.calibration = own;
  const bool is_depth = description.kind == SequenceKind::Rgbd;
  const bool knows_camera = description.calibration || !options.calibration_file.empty();
  if (!knows_camera && description.kind != SequenceKind::Clouds)
    throw IoError(joined(folder, "calib.yaml"),
                  std::string("no such file; ") +
                      (is_depth ? "an RGB-D sequence" : "a stereo sequence") +
                      " needs it, or a calibration by --calib FILE: image_width, "
                      "image_height, fx, fy, cx, cy, " +
                      (is_depth ? "depth_scale (units a metre)" : "baseline_m"));
  switch (description.kind) {
    case SequenceKind::Clouds:
      readClouds(folder, description);
      break;
    case SequenceKind::Rgbd:
      readRgbd(folder, description);
      break;
    case SequenceKind::Stereo:
      readStereo(folder, description);
      break;
  }
  const std::string poses = joined(folder, "poses.txt");
  if (options.poses_file.empty() && exists(poses)) addPoses(poses, options, description);
  return description;
}

}  // namespace planar_mapping::io::layouts
