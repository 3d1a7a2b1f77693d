// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "cell_layer.h"
#include "planar_mapping/map/planar_map.h"
#include "plane_layer.h"
#include "unknown_space.h"

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

/// All that a map knows: plain values, copied with it and written to its file.
struct MapData {
  PlanarMapParams params;
  std::vector<PlaneLayer> planes;  ///< by id, ascending
  std::int32_t next_plane_id = 0;
  CellLayer cells;
  UnknownSpace unknown;
  std::vector<StoredPose> trajectory;

  double resolution() const { return params.approximation.resolution; }
  double unknownResolution() const {
    return params.unknown_resolution > 0.0 ? params.unknown_resolution : resolution();
  }
  double thickness() const {
    const CuboidApproximationParams& p = params.approximation;
    return p.thickness > 0.0 ? p.thickness : p.resolution;
  }
  bool isCompact() const { return params.approximation.profile == Profile::Compact; }
};

/// Stamps what was touched, for those who derive cuboids from it, and forgets what is empty.
void tidyMap(MapData& map, FrameUpdate& update);

}  // namespace planar_mapping::detail
