// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "store/stored_pose.h"

#include <cmath>

namespace planar_mapping::detail {

bool isInMicroseconds(double timestamp, std::int64_t& microseconds) {
  if (!(std::abs(timestamp) < 4e9)) return false;
  microseconds = std::llround(timestamp * 1e6);
  return static_cast<double>(microseconds) / 1e6 == timestamp;
}

StoredPose StoredPose::from(double timestamp, const Quaternion& orientation,
                            const Vector3& position) {
  StoredPose stored;
  // To the microsecond; what is no time of ours stays as it is.
  stored.timestamp = std::abs(timestamp) < 4e9 ? std::round(timestamp * 1e6) / 1e6 : timestamp;
  for (std::size_t i = 0; i < 3; ++i) {
    stored.position[i] = std::llround(position[static_cast<int>(i)] * kPositionUnits);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    stored.orientation[i] = static_cast<std::int16_t>(
        std::lround(orientation.coeffs()[static_cast<int>(i)] * kOrientationUnits));
  }
  return stored;
}

void StoredPose::alignTo(const StoredPose& other) {
  std::int64_t dot = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    dot += std::int64_t{orientation[i]} * other.orientation[i];
  }
  if (dot >= 0) return;
  for (std::int16_t& part : orientation) part = static_cast<std::int16_t>(-part);
}

Vector3 StoredPose::sensor() const {
  return Vector3(static_cast<double>(position[0]), static_cast<double>(position[1]),
                 static_cast<double>(position[2])) /
         kPositionUnits;
}

Pose StoredPose::pose() const {
  Quaternion q;
  for (int i = 0; i < 4; ++i) q.coeffs()[i] = orientation[static_cast<std::size_t>(i)];
  Pose pose = Pose::Identity();
  pose.linear() = q.normalized().toRotationMatrix();
  pose.translation() = sensor();
  return pose;
}

}  // namespace planar_mapping::detail
