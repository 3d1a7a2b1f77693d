// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "layouts/folder.h"
#include "layouts/layout.h"
#include "layouts/times.h"
#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace io {
namespace layouts {
namespace {

struct Reader {
  const char* name;
  bool (*has)(const std::string&);
  Description (*read)(const std::string&, const SequenceOptions&);
};

constexpr Reader kReaders[] = {{"KITTI odometry", hasKitti, readKitti},
                               {"TUM RGB-D", hasTum, readTum},
                               {"ICL-NUIM", hasIcl, readIcl},
                               {"EuRoC (ASL)", hasEuroc, readEuroc},
                               {"Middlebury", hasMiddlebury, readMiddlebury},
                               {"Open3D RGB-D", hasOpen3d, readOpen3d}};

/// A directory of cloud files, in name order.
Description readCloudFiles(const std::string& folder, const SequenceOptions& options) {
  Description description;
  description.layout = "cloud files";
  description.pose_source = PoseSource::Viewpoint;
  for (const std::string& file : cloudFilesOf(folder))
    description.frames.push_back({file, {}, {}, {}});
  if (description.frames.empty() && !options.growing)
    throw IoError(
        folder,
        "holds neither PCD or PLY files nor a sequence (calib.yaml with clouds/, depth/ or "
        "left/ and right/; or KITTI, TUM RGB-D, ICL-NUIM, EuRoC, Middlebury, Open3D)");
  const std::string poses = joined(folder, "poses.txt");
  if (options.poses_file.empty() && exists(poses)) addPoses(poses, options.growing, description);
  return description;
}

}  // namespace

Description readFolder(const std::string& folder, const SequenceOptions& options) {
  const Reader* reader = nullptr;
  std::string names;
  for (const Reader& one : kReaders) {
    if (!one.has(folder)) continue;
    reader = &one;
    names += (names.empty() ? "" : " and ") + std::string(one.name);
  }
  // A calib.yaml beside depth/ is the camera of a foreign layout, too.
  const bool own_parts = isDirectory(joined(folder, "clouds")) ||
                         isDirectory(joined(folder, "left")) ||
                         isDirectory(joined(folder, "right"));
  if (own_parts && reader != nullptr) names += " and a sequence folder (clouds/, left/, right/)";
  if (names.find(" and ") != std::string::npos)
    throw IoError(folder, "looks like " + names + "; move what is not meant out of it");
  if (reader != nullptr) return reader->read(folder, options);
  return hasNative(folder) ? readNative(folder, options) : readCloudFiles(folder, options);
}

bool isSequenceFolder(const std::string& folder) {
  bool is_one = hasNative(folder);
  for (const Reader& reader : kReaders) is_one = is_one || reader.has(folder);
  return is_one;
}

void addPoses(const std::string& file, bool growing, Description& description) {
  const Trajectory trajectory = readTrajectory(file);
  const std::vector<StampedPose>& poses = trajectory.poses;
  std::vector<FrameEntry>& frames = description.frames;
  bool frames_have_times = !frames.empty();
  for (const FrameEntry& frame : frames) frames_have_times = frames_have_times && frame.timestamp;
  if (poses.size() != frames.size() && trajectory.has_times && frames_have_times &&
      !poses.empty()) {
    addPosesByTime(file, poses, Pose::Identity(), description);
    return;
  }
  if (growing && poses.size() < frames.size()) frames.resize(poses.size());
  if (poses.size() != frames.size() && !growing)
    throw IoError(file, "holds " + std::to_string(poses.size()) + " poses for " +
                            std::to_string(frames.size()) +
                            " frames; it needs a line for each, in their order");
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].T_world_sensor = poses[i].pose;
    if (!frames[i].timestamp) frames[i].timestamp = poses[i].timestamp;
  }
  description.pose_source = PoseSource::File;
}

}  // namespace layouts
}  // namespace io
}  // namespace planar_mapping
