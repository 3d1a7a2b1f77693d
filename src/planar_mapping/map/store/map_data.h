// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "planar_mapping/map/store/cell_layer.h"
#include "planar_mapping/map/store/ground_places.h"
#include "planar_mapping/map/store/planar_map_params.h"
#include "planar_mapping/map/store/plane_layer.h"
#include "planar_mapping/map/store/unknown_space.h"

namespace planar_mapping::detail {

/// Largest coordinate of a pose, metres.
constexpr double kFarthestPose = 1e14;

/// Pose of the sensor in the world when a frame was taken.
struct FramePose {
  double timestamp = 0.0;  ///< seconds
  Vector3 position = Vector3::Zero();
  Quaternion orientation = Quaternion::Identity();

  Pose pose() const {
    Pose pose = Pose::Identity();
    pose.linear() = orientation.toRotationMatrix();
    pose.translation() = position;
    return pose;
  }
};

/// All that a map knows: plain values, copied with it and written to its file.
struct MapData {
  explicit MapData(const PlanarMapParams& p = PlanarMapParams()) : params(p), space(p.unseen) {}

  PlanarMapParams params;
  std::vector<PlaneLayer> planes;  ///< by id, ascending
  std::int32_t next_plane_id = 0;
  CellLayer cells;
  UnknownSpace space;
  std::vector<FramePose> trajectory;
  GroundPlaces ground;

  double resolution() const { return params.approximation.resolution; }
  double unknownResolution() const {
    return params.unknown_resolution > 0.0 ? params.unknown_resolution : resolution();
  }
  /// Depths up to which frames say what space is, and which cells are missed.
  double maxRange() const {
    return params.max_range > 0.0 ? params.max_range : kMaxRangeCells * unknownResolution();
  }
  double missRange() const {
    return params.miss_range > 0.0 ? std::min(params.miss_range, maxRange()) : maxRange();
  }
  double thickness() const {
    const CuboidApproximationParams& p = params.approximation;
    return p.thickness > 0.0 ? p.thickness : p.resolution;
  }
  /// The plane of an id that there is.
  const PlaneLayer& plane(std::int32_t id) const;
  /// Number of the current state: another one after each frame.
  std::uint32_t revision() const { return static_cast<std::uint32_t>(trajectory.size() + 1); }
  bool isCompact() const { return params.approximation.profile == Profile::Compact; }
  std::size_t memoryBytes() const;  ///< on the heap

  /// Ends a frame: bumps the revision of modified patches and regions, which tells what cuboids are
  /// to be derived again, and removes planes, patches and regions without a cell.
  /// \return how many patches and regions were modified
  std::size_t commit();
};

}  // namespace planar_mapping::detail
