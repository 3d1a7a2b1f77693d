// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "planar_mapping/core/base/types.h"

namespace planar_mapping::detail {

/// Pose of a frame as the file keeps it: what is saved is what the live map answers.
struct StoredPose {
  double timestamp = 0.0;
  static constexpr int kPositionUnits = 4096;     ///< a metre
  static constexpr int kOrientationUnits = 8191;  ///< length of the quaternion

  std::array<std::int64_t, 3> position{};
  std::array<std::int16_t, 4> orientation{};  ///< quaternion x y z w

  static StoredPose from(double timestamp, const Quaternion& orientation, const Vector3& position);
  /// Takes the one of the two quaternions of the same rotation that is nearer to that of another
  /// pose, so that sequences have no jumps.
  void alignTo(const StoredPose& other);
  Vector3 sensor() const;
  Pose pose() const;
};
/// Largest coordinate of a pose, metres: what StoredPose can hold.
constexpr double kFarthestPose = 1e14;

/// Time stamps are mostly whole microseconds. \return whether this one is, and them
bool isInMicroseconds(double timestamp, std::int64_t& microseconds);

}  // namespace planar_mapping::detail
