// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "planar_mapping/core/base/types.h"

namespace planar_mapping::detail {

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
