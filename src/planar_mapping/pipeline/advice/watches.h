// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/base/types.h"
#include "planar_mapping/cuboids/cuboid_approximation.h"
#include "planar_mapping/planes/multi_plane.h"

namespace planar_mapping::detail {

/// Looks whether the walls of a frame, by its given pose, lie on those of the frame before. Where
/// they do not, the clouds erase each other.
class PoseWatch {
 public:
  /// The median distance between walls seen in both frames, metres, of those along the direction of
  /// most or of those across, whichever is larger; if it is more than a cell of the map for the
  /// first time. Along a hall only what stands across tells how far the sensor came.
  /// \param planes of the points, in the sensor's frame
  PLANAR_MAPPING_EXPORT std::optional<double> misfit(const PointsView& points,
                                                     const std::vector<PlaneSegment>& planes,
                                                     const Pose& T_world_sensor,
                                                     const CuboidApproximationParams& cells);

  template <typename Archive>
  void visitState(Archive& archive) {
    archive(done_, before_);
  }

 private:
  /// A piece of a wall, in the world.
  struct Piece {
    std::int32_t x = 0, y = 0, z = 0;  ///< cell of kSide
    std::array<double, 3> place{};
    std::array<double, 3> normal{};
  };
  static std::vector<Piece> wallsOf(const PointsView& points,
                                    const std::vector<PlaneSegment>& planes,
                                    const Pose& T_world_sensor, const Vector3& up);

  bool done_ = false;
  std::vector<Piece> before_;
};

/// Looks whether the depths of a camera are distances along its rays, as some simulators and file
/// formats give them, taken for depths along its axis: that bends every wall.
class DepthWatch {
 public:
  static constexpr const char* kAdvice =
      "planes are bent, and would be flat if the depth images held distances along the rays of the "
      "pixels: if they do, write depth_along: ray into calib.yaml";

  /// Whether it is certain with this frame, which is said once.
  /// \param points  in the camera's frame, z forward
  /// \param is_only no other frame will tell
  PLANAR_MAPPING_EXPORT bool isBentIn(const PointsView& points, bool is_only);

  template <typename Archive>
  void visitState(Archive& archive) {
    archive(looks_, bent_);
  }

 private:
  int looks_ = 0;  ///< frames looked at
  int bent_ = 0;   ///< of those
};

/// Looks for the robot in the scans of its own scanner: near points that stay where they are in the
/// frame of a sensor that moves.
class RobotWatch {
 public:
  static constexpr const char* kAdvice =
      "a tenth of the points or more are within 0.5 m of the sensor and move with it: if they are "
      "of the robot that carries it, a stage crop_box with min_x_m, min_y_m, min_z_m -0.5, "
      "max_x_m, max_y_m, max_z_m 0.5 and negative true, before the others, leaves them out";

  /// Whether it is certain with this scan, which is said once.
  bool isSeenIn(const PointsView& points, const Indices& indices, const Pose& T_world_sensor);

  template <typename Archive>
  void visitState(Archive& archive) {
    archive(done_, first_pose_, first_near_);
  }

 private:
  bool done_ = false;  ///< there is none, or it was said
  std::optional<Pose> first_pose_;
  std::vector<std::uint8_t> first_near_;  ///< marks of cells near the sensor with points
};

}  // namespace planar_mapping::detail
