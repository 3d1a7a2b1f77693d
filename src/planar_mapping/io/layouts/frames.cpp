// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// What layouts have in common: images in pairs, lists with times, poses of frames.
#include <algorithm>
#include <cmath>

#include "planar_mapping/base/error.h"
#include "planar_mapping/io/layouts/layout.h"
#include "planar_mapping/io/text_lines.h"

namespace planar_mapping::io::layouts {
namespace {

/// Largest difference of two times of one frame, seconds: less than half a period at 25 Hz.
constexpr double kMaxTimeDifference = 0.02;

template <typename Stamped>
auto firstNotBefore(const std::vector<Stamped>& list, double timestamp) {
  return std::lower_bound(list.begin(), list.end(), timestamp,
                          [](const Stamped& one, double time) { return one.timestamp < time; });
}

/// The nearest of an ascending list within kMaxTimeDifference.
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

template <typename Stamped>
void sortByTime(std::vector<Stamped>& list) {
  std::stable_sort(list.begin(), list.end(),
                   [](const Stamped& a, const Stamped& b) { return a.timestamp < b.timestamp; });
}

/// Between two poses that are near each other interpolated, else the nearest one.
std::optional<Pose> poseAt(const std::vector<StampedPose>& poses, double timestamp) {
  constexpr double kMaxGap = 0.1;  // seconds: a hand turns by a few degrees meanwhile
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

void requirePairs(std::size_t pairs, const std::string& folder, const std::string (&names)[2],
                  const std::size_t (&sizes)[2]) {
  if (pairs > 0) return;
  throw IoError(folder, names[0] + "/ (" + std::to_string(sizes[0]) + " images) and " + names[1] +
                            "/ (" + std::to_string(sizes[1]) +
                            ") have no file name or number in common (PNG, JPEG, PGM or PPM)");
}

void addByLine(const std::string& file, const std::vector<StampedPose>& poses,
               const SequenceOptions& options, Description& description) {
  std::vector<FrameEntry>& frames = description.frames;
  if (options.growing && poses.size() < frames.size()) frames.resize(poses.size());
  if (poses.size() != frames.size() && !options.growing) {
    const std::string count = "holds " + std::to_string(poses.size()) + " poses for " +
                              std::to_string(frames.size()) + " frames; ";
    if (!options.ignore_poses)
      throw IoError(file, count + "it needs a line for each, in their order");
    description.notes.push_back(file + ": " + count + "none of them is used");
    return;
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].T_world_sensor = poses[i].pose;
    if (!frames[i].timestamp) frames[i].timestamp = poses[i].timestamp;
  }
  description.pose_source = PoseSource::File;
}

}  // namespace

std::optional<double> numberOf(const std::string& name) {
  const std::size_t digits = name.find_last_not_of("0123456789") + 1;
  double number = 0.0;
  if (digits >= name.size() || !parseNumber(std::string_view(name).substr(digits), number))
    return std::nullopt;
  return number;
}

void listStereo(const std::string& folder, const std::string& left, const std::string& right,
                Description& description) {
  for (const std::string& part : {left, right})
    if (!isDirectory(joined(folder, part)))
      throw IoError(joined(folder, part), "no such directory; a stereo sequence needs it");
  FilesByName lefts = byName(imageFilesOf(joined(folder, left)));
  FilesByName rights = byName(imageFilesOf(joined(folder, right)));
  const std::size_t pairs = matchNames(lefts, rights);
  const NameOrder is_before;
  for (auto l = lefts.begin(), r = rights.begin(); l != lefts.end() || r != rights.end();) {
    const bool has_left = l != lefts.end() && (r == rights.end() || !is_before(r->first, l->first));
    const bool has_right =
        r != rights.end() && (l == lefts.end() || !is_before(l->first, r->first));
    // A missing left image has the name it should have: the frame keeps its place.
    description.frames.push_back(
        {has_left ? l->second : joined(joined(folder, left), nameOf(r->second)),
         has_right ? r->second : "",
         {},
         {}});
    if (has_left) ++l;
    if (has_right) ++r;
  }
  requirePairs(pairs, folder, {left, right}, {lefts.size(), rights.size()});
}

void listDepth(const std::string& folder, const std::string& color, Description& description) {
  FilesByName depths = byName(depthFilesOf(joined(folder, "depth")));
  description.has_color = !color.empty();
  FilesByName colors = color.empty() ? FilesByName() : byName(imageFilesOf(joined(folder, color)));
  const std::size_t pairs = matchNames(depths, colors);
  for (const auto& [name, file] : depths)
    description.frames.push_back({file, fileOf(colors, name), {}, {}});
  if (!color.empty()) requirePairs(pairs, folder, {"depth", color}, {depths.size(), colors.size()});
}

void listClouds(const std::string& folder, Description& description) {
  description.pose_source = PoseSource::Viewpoint;
  for (const std::string& file : cloudFilesOf(folder))
    description.frames.push_back({file, {}, {}, {}});
}

void listByTime(std::vector<StampedFile> firsts, std::vector<StampedFile> seconds,
                const std::string& folder, const std::string (&names)[2],
                Description& description) {
  sortByTime(firsts);
  sortByTime(seconds);
  for (const StampedFile& first : firsts) {
    if (const StampedFile* second = nearest(seconds, first.timestamp))
      description.frames.push_back({first.file, second->file, first.timestamp, {}});
  }
  if (description.frames.empty())
    throw IoError(folder, names[1] + " has no image within 20 ms of any of " + names[0]);
  noteLeftOut(firsts.size() - description.frames.size(), firsts.size(), "images of " + names[0],
              names[1] + " has no image within 20 ms of them", description);
}

void noteLeftOut(std::size_t left_out, std::size_t all, const std::string& what,
                 const std::string& why, Description& description) {
  if (left_out == 0) return;
  description.notes.push_back(std::to_string(left_out) + " of " + std::to_string(all) + " " + what +
                              " are left out: " + why);
}

void addPoses(const std::string& file, Trajectory trajectory, PosesBy by, const Pose& T_pose_sensor,
              const SequenceOptions& options, Description& description) {
  std::vector<StampedPose>& poses = trajectory.poses;
  std::vector<FrameEntry>& frames = description.frames;
  const bool have_times =
      trajectory.has_times && !frames.empty() &&
      std::all_of(frames.begin(), frames.end(), [](const auto& f) { return f.timestamp; });
  if (by == PosesBy::Line && (poses.size() == frames.size() || poses.empty() || !have_times))
    return addByLine(file, poses, options, description);

  sortByTime(poses);
  const std::size_t all = frames.size();
  std::size_t posed = 0;
  const bool is_same = T_pose_sensor.matrix() == Pose::Identity().matrix();
  for (FrameEntry& frame : frames) {
    const auto& key = by == PosesBy::Number ? frame.number : frame.timestamp;
    const std::optional<Pose> pose = key ? poseAt(poses, *key) : std::nullopt;
    if (pose) frame.T_world_sensor = is_same ? *pose : *pose * T_pose_sensor;
    posed += pose ? 1 : 0;
  }
  const bool by_number = by == PosesBy::Number;
  if (posed < all && !options.ignore_poses) {
    if (posed == 0 && !options.growing)
      throw IoError(file, (by_number ? "has no pose of any of the "
                                     : "has no pose within 20 ms of any of the ") +
                              std::to_string(all) + " frames" +
                              (by_number ? "" : "; do their times count from the same start?"));
    frames.erase(std::remove_if(frames.begin(), frames.end(),
                                [](const FrameEntry& f) { return !f.T_world_sensor; }),
                 frames.end());
    noteLeftOut(all - posed, all, "frames",
                file + (by_number ? " has no pose of them" : " has no pose within 20 ms of them"),
                description);
  }
  if (posed > 0 || !options.ignore_poses) description.pose_source = PoseSource::File;
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

}  // namespace planar_mapping::io::layouts
