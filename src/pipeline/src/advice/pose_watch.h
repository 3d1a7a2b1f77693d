// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/core/cuboids/cuboid_approximation.h"
#include "planar_mapping/core/planes/multi_plane.h"

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

}  // namespace planar_mapping::detail
