// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/planes/assumed/assumed_points.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping {

/// What one frame brings to the map. Everything is in the sensor's frame but the pose.
struct FrameObservation {
  Pose T_world_sensor = Pose::Identity();
  double timestamp = 0.0;            ///< seconds
  PointsView points;                 ///< the whole cloud, as measured
  const Indices* indices = nullptr;  ///< the points to be mapped; null = all
  const Indices* ground = nullptr;   ///< removed ground: clears space, makes no cell
  const std::vector<PlaneSegment>* planes = nullptr;  ///< null = none
  const std::vector<float>* probability = nullptr;    ///< belief per point; null = 1
  /// Of the planes, where nothing was measured: makes cells, clears no space, moves no plane; null
  /// = none.
  const AssumedPoints* assumed = nullptr;
  /// Depth error of a stereo camera: widens surfaces, far points clear less; absent = none.
  std::optional<StereoNoise> noise;
  /// Known intrinsics of an organized cloud; absent = estimated from it, else
  /// six images around the sensor are made of the points.
  std::optional<PinholeCamera> camera;
};

/// What an insertion did.
struct FrameUpdate {
  std::size_t planes_new = 0;
  std::size_t planes_matched = 0;
  std::size_t planes_merged = 0;  ///< planes of the map that turned out to be another one
  std::size_t cells_added = 0;
  std::size_t cells_removed = 0;
  std::size_t patches_rebuilt = 0;
  std::size_t absorbed_points = 0;
  std::size_t dropped_points = 0;  ///< not finite, beyond the world, or too few in their cell
  std::size_t points_beyond = 0;   ///< of those, beyond the world
  /// PlanarMapping: the cloud that began the map cannot have been seen from its origin, so that the
  /// map knows no free space.
  bool merged_cloud = false;
  /// Metres from the sensor up to which all space was classified that the frame tells of; less than
  /// infinity where that was too much for one frame: what is farther may have stayed unknown.
  double space_range = std::numeric_limits<double>::infinity();
};

}  // namespace planar_mapping
