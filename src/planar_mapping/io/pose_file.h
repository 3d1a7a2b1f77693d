// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"
#include "planar_mapping/io/atomic_file.h"

namespace planar_mapping::io {

struct StampedPose {
  double timestamp = 0.0;  ///< seconds
  Pose pose = Pose::Identity();
};

/// Reads a trajectory in TUM format: `timestamp tx ty tz qx qy qz qw` a line, metres; empty lines
/// and what follows a `#` are skipped. Quaternions may be off unit length by the rounding of text
/// (0.001 [ours]) and are normalised.
/// \throws IoError with the line number: wrong count, no number, not finite, no unit quaternion
PLANAR_MAPPING_EXPORT std::vector<StampedPose> readTumPoses(const std::string& path);

/// Poses of a file in either of the usual formats.
struct Trajectory {
  std::vector<StampedPose> poses;
  bool has_times = true;  ///< false for KITTI's: timestamps are the numbers of the lines, from 0
};

/// Reads a trajectory as TUM (8 numbers a line) or KITTI odometry (12 numbers a line: the upper
/// three rows of T_world_camera, row by row) write it, whichever its first line is.
/// \throws IoError with the line number: wrong count, no number, not finite, no rotation
PLANAR_MAPPING_EXPORT Trajectory readTrajectory(const std::string& path);

/// The same text for every locale; doubles survive writing and reading.
/// \throws InputError for a time that is not finite or a pose that is no rigid motion
PLANAR_MAPPING_EXPORT std::string toTum(const std::vector<StampedPose>& poses);
/// \throws IoError; InputError as toTum()
PLANAR_MAPPING_EXPORT void writeTumPoses(const std::string& path,
                                         const std::vector<StampedPose>& poses,
                                         Overwrite overwrite = Overwrite::Refuse);

}  // namespace planar_mapping::io
