// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/base/error.h"

namespace planar_mapping::io::layouts {
namespace {

template <typename Stamped>
auto firstNotBefore(const std::vector<Stamped>& list, double timestamp) {
  return std::lower_bound(list.begin(), list.end(), timestamp,
                          [](const Stamped& one, double time) { return one.timestamp < time; });
}

/// The nearest of an ascending list, if it is near enough.
template <typename Stamped>
const Stamped* nearest(const std::vector<Stamped>& list, double timestamp) {
  const auto after = firstNotBefore(list, timestamp);
  const Stamped* best = nullptr;
  double least = kMaxTimeDifference;
  for (auto it = after == list.begin() ? after : after - 1; it != list.end() && it <= after; ++it) {
    const double difference = std::abs(it->timestamp - timestamp);
    if (difference > least) continue;
    least = difference;
    best = &*it;
  }
  return best;
}

struct Reader {
  const char* name;
  Has* has;
  Read* read;
};

constexpr Reader kReaders[] = {{"KITTI odometry", hasKitti, readKitti},
                               {"TUM RGB-D", hasTum, readTum},
                               {"ICL-NUIM", hasIcl, readIcl},
                               {"EuRoC (ASL)", hasEuroc, readEuroc},
                               {"Middlebury", hasMiddlebury, readMiddlebury},
                               {"Open3D RGB-D", hasOpen3d, readOpen3d},
                               {"KITTI raw", hasKittiRaw, readKittiRaw},
                               {"Replica", hasReplica, readReplica},
                               {"Stray Scanner", hasStray, readStray},
                               {"RGB-D with a pose a frame", hasPosedFrames, readPosedFrames}};

/// A directory of cloud files, in name order.
Description readCloudFiles(const std::string& folder, const SequenceOptions& options) {
  Description description("cloud files", SequenceKind::Clouds);
  description.pose_source = PoseSource::Viewpoint;
  for (const std::string& file : cloudFilesOf(folder))
    description.frames.push_back({file, {}, {}, {}});
  if (description.frames.empty() && !options.growing)
    throw IoError(
        folder,
        "holds neither PCD or PLY files nor a sequence (calib.yaml with clouds/, depth/ or "
        "left/ and right/; or KITTI, TUM RGB-D, ICL-NUIM, EuRoC, Middlebury, Open3D, 3DMatch, "
        "ScanNet, Replica, Stray Scanner)" +
            adviceOnFiles(folder));
  const std::string poses = joined(folder, "poses.txt");
  if (options.poses_file.empty() && exists(poses)) addPoses(poses, options, description);
  return description;
}

template <typename Predicate>
void dropIf(Description& description, const Predicate& is_dropped) {
  auto& frames = description.frames;
  frames.erase(std::remove_if(frames.begin(), frames.end(), is_dropped), frames.end());
}

/// Poses between two of an ascending list, at most 0.1 s apart, are interpolated; others are taken
/// from the nearest one, if it is near enough.
std::optional<Pose> poseAt(const std::vector<StampedPose>& poses, double timestamp) {
  constexpr double kMaxGap = 0.1;
  const auto after = firstNotBefore(poses, timestamp);
  if (after != poses.end() && after->timestamp == timestamp) return after->pose;
  if (after != poses.begin() && after != poses.end()) {
    const StampedPose& a = *(after - 1);
    const double gap = after->timestamp - a.timestamp;
    if (gap <= kMaxGap) {
      const double part = (timestamp - a.timestamp) / gap;
      Pose pose = Pose::Identity();
      pose.linear() = Eigen::Quaterniond(Matrix3(a.pose.linear()))
                          .slerp(part, Eigen::Quaterniond(Matrix3(after->pose.linear())))
                          .toRotationMatrix();
      pose.translation() = (1.0 - part) * a.pose.translation() + part * after->pose.translation();
      return pose;
    }
  }
  const StampedPose* const near = nearest(poses, timestamp);
  return near == nullptr ? std::nullopt : std::optional<Pose>(near->pose);
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

std::string adviceOnFiles(const std::string& folder) {
  if (exists(joined(folder, "metadata")) && isDirectory(joined(folder, "rgbd")))
    return "; the .depth files of Record3D are not read: write them as PNG images of 16 bits "
           "(millimetres) into depth/, its images into rgb/, and calib.yaml from K of metadata, "
           "scaled to the size of the depth images, with depth_scale: 1000";
  if (isDirectory(joined(folder, "depth_left")))
    return "; TartanAir is not read as it is: write depth_left/*.npy (metres) as PNG images of 16 "
           "bits into depth/, copy image_left/ to rgb/ with the same numbers, and write "
           "calib.yaml; "
           "its poses are of a body with x forward, y right and z down";
  if (imageFilesOf(folder).empty()) return "";
  return "; images of a stereo camera belong into left/ and right/ (left_0.png and right_0.png "
         "are a pair; cut images that show both views side by side into halves), those of a depth "
         "camera into depth/ and rgb/";
}

bool isSequenceFolder(const std::string& folder) {
  bool is_one = hasNative(folder);
  for (const Reader& reader : kReaders) is_one = is_one || reader.has(folder);
  return is_one;
}

void noteLeftOut(std::size_t left_out, std::size_t all, const std::string& what,
                 const std::string& why, Description& description) {
  if (left_out == 0) return;
  description.notes.push_back(std::to_string(left_out) + " of " + std::to_string(all) + " " + what +
                              " are left out: " + why);
}

std::optional<Calibration> ownCalibration(const std::string& folder) {
  const std::string own = joined(folder, "calib.yaml");
  return exists(own) ? std::optional<Calibration>(readCalibration(own)) : std::nullopt;
}

Calibration depthCalibration(const PinholeCamera& camera, double depth_scale) {
  Calibration calibration;
  calibration.camera = camera;
  calibration.cx_right = camera.cx;
  calibration.depth_scale = depth_scale;
  return calibration;
}

std::size_t listFiles(const FilesByName& files, const FilesByName& partners,
                      Description& description) {
  std::size_t pairs = 0;
  for (const auto& [name, file] : files) {
    pairs += partners.count(name);
    description.frames.push_back({file, fileOf(partners, name), {}, {}});
  }
  return pairs;
}

void listPairs(const FilesByName& depths, const FilesByName& colors, Description& description) {
  const std::size_t pairs = listFiles(depths, colors, description);
  description.has_color = true;
  noteLeftOut(depths.size() - pairs, depths.size(), "depth images",
              "no colour image has their name or number", description);
  noteLeftOut(colors.size() - pairs, colors.size(), "colour images",
              "no depth image has their name or number", description);
}

void dropUnpaired(Description& description) {
  dropIf(description, [](const FrameEntry& frame) { return frame.partner.empty(); });
}

void dropWithoutPose(Description& description) {
  dropIf(description, [](const FrameEntry& frame) { return !frame.T_world_sensor; });
}

void notUsed(const std::string& file, std::size_t poses, Description& description) {
  description.notes.push_back(file + ": holds " + std::to_string(poses) + " poses for " +
                              std::to_string(description.frames.size()) +
                              " frames; none of them is used");
}

void addPoses(const std::string& file, const SequenceOptions& options, Description& description) {
  const Trajectory trajectory = readTrajectory(file);
  const std::vector<StampedPose>& poses = trajectory.poses;
  std::vector<FrameEntry>& frames = description.frames;
  bool frames_have_times = !frames.empty();
  for (const FrameEntry& frame : frames) frames_have_times = frames_have_times && frame.timestamp;
  if (poses.size() != frames.size() && trajectory.has_times && frames_have_times && !poses.empty())
    return addPosesByTime(file, poses, Pose::Identity(), options, description);
  if (options.growing && poses.size() < frames.size()) frames.resize(poses.size());
  if (poses.size() != frames.size() && !options.growing) {
    if (!options.ignore_poses)
      throw IoError(file, "holds " + std::to_string(poses.size()) + " poses for " +
                              std::to_string(frames.size()) +
                              " frames; it needs a line for each, in their order");
    notUsed(file, poses.size(), description);
    return;
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].T_world_sensor = poses[i].pose;
    if (!frames[i].timestamp) frames[i].timestamp = poses[i].timestamp;
  }
  description.pose_source = PoseSource::File;
}

const StampedFile* nearestFile(const std::vector<StampedFile>& files, double timestamp) {
  return nearest(files, timestamp);
}

void addPosesByTime(const std::string& file, std::vector<StampedPose> poses,
                    const Pose& T_pose_sensor, const SequenceOptions& options,
                    Description& description) {
  std::stable_sort(poses.begin(), poses.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.timestamp < b.timestamp;
  });
  std::vector<FrameEntry> kept;
  for (FrameEntry& frame : description.frames) {
    const std::optional<Pose> pose = poseAt(poses, *frame.timestamp);
    if (!pose && !options.ignore_poses) continue;
    const bool is_same = T_pose_sensor.matrix() == Pose::Identity().matrix();
    if (pose) frame.T_world_sensor = is_same ? *pose : *pose * T_pose_sensor;
    kept.push_back(std::move(frame));
  }
  const std::size_t all = description.frames.size();
  if (kept.empty())
    throw IoError(file, "has no pose within 20 ms of any of the " + std::to_string(all) +
                            " frames; do their times count from the same start?");
  noteLeftOut(all - kept.size(), all, "frames", file + " has no pose within 20 ms of them",
              description);
  description.frames = std::move(kept);
  description.pose_source = PoseSource::File;
}

}  // namespace planar_mapping::io::layouts
