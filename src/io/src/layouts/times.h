// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "layouts/layout.h"
#include "planar_mapping/io/pose_file.h"

// Times of different sensors, matched.
namespace planar_mapping {
namespace io {
namespace layouts {

constexpr double kMaxTimeDifference = 0.02;  ///< seconds between what belongs together

/// A file of a list with times.
struct StampedFile {
  double timestamp = 0.0;
  std::string file;
};

/// The file nearest in time, if one is near enough; \p files ascend in time.
const StampedFile* nearestFile(const std::vector<StampedFile>& files, double timestamp);

/// Poses between two of the list, at most 0.1 s apart, are interpolated; others are taken from the
/// nearest one, if it is near enough.
class PoseTimeline {
 public:
  explicit PoseTimeline(std::vector<StampedPose> poses);
  std::optional<Pose> at(double timestamp) const;

 private:
  std::vector<StampedPose> poses_;
};

/// Sets the pose of each frame by its time and leaves frames without one out, with a note.
/// \param T_pose_sensor  of the sensor in what the poses are of
/// \throws IoError naming \p file if no frame has a pose
void addPosesByTime(const std::string& file, std::vector<StampedPose> poses,
                    const Pose& T_pose_sensor, Description& description);

}  // namespace layouts
}  // namespace io
}  // namespace planar_mapping
