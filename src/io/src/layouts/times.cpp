// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "layouts/times.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {
namespace io {
namespace layouts {
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

}  // namespace

const StampedFile* nearestFile(const std::vector<StampedFile>& files, double timestamp) {
  return nearest(files, timestamp);
}

PoseTimeline::PoseTimeline(std::vector<StampedPose> poses) : poses_(std::move(poses)) {
  std::stable_sort(poses_.begin(), poses_.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.timestamp < b.timestamp;
  });
}

std::optional<Pose> PoseTimeline::at(double timestamp) const {
  constexpr double kMaxGap = 0.1;
  const auto after = firstNotBefore(poses_, timestamp);
  if (after != poses_.end() && after->timestamp == timestamp) return after->pose;
  if (after != poses_.begin() && after != poses_.end()) {
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
  const StampedPose* const near = nearest(poses_, timestamp);
  return near == nullptr ? std::nullopt : std::optional<Pose>(near->pose);
}

void addPosesByTime(const std::string& file, std::vector<StampedPose> poses,
                    const Pose& T_pose_sensor, Description& description) {
  const PoseTimeline timeline(std::move(poses));
  std::vector<FrameEntry> kept;
  for (FrameEntry& frame : description.frames) {
    const std::optional<Pose> pose = timeline.at(*frame.timestamp);
    if (!pose) continue;
    const bool is_same = T_pose_sensor.matrix() == Pose::Identity().matrix();
    frame.T_world_sensor = is_same ? *pose : *pose * T_pose_sensor;
    kept.push_back(std::move(frame));
  }
  const std::size_t all = description.frames.size();
  if (kept.empty())
    throw IoError(file, "has no pose within 20 ms of any of the " + std::to_string(all) +
                            " frames; do their times count from the same start?");
  if (kept.size() < all)
    description.notes.push_back(std::to_string(all - kept.size()) + " of " + std::to_string(all) +
                                " frames are left out: " + file +
                                " has no pose within 20 ms of them");
  description.frames = std::move(kept);
  description.pose_source = PoseSource::File;
}

}  // namespace layouts
}  // namespace io
}  // namespace planar_mapping
