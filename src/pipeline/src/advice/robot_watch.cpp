// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "advice/robot_watch.h"

#include "planar_mapping/core/geometry/cloud_scale.h"
#include "planar_mapping/core/geometry/detail/angles.h"

namespace planar_mapping::detail {

bool RobotWatch::isSeenIn(const PointsView& points, const Indices& indices,
                          const Pose& T_world_sensor) {
  constexpr double kNear = 0.5;  // metres
  constexpr int kSide = 20;      // of cells of 5 cm
  constexpr double kMinFraction = 0.1;
  constexpr double kMinTurn = 30.0 * kRadiansPerDegree;
  if (done_) return false;
  const bool is_first = !first_pose_;
  if (is_first) {
    done_ = points.isOrganized() || isCameraView(points, &indices);
    first_pose_ = T_world_sensor;
  }
  first_near_.resize(kSide * kSide * kSide);  // whatever a damaged state says
  std::size_t same = 0;
  for (const int i : indices) {
    const Vector3 p = points.point(static_cast<std::size_t>(i));
    if (!(p.norm() < kNear)) continue;
    const Eigen::Array3i at = ((p.array() + kNear) * (0.5 * kSide / kNear)).cast<int>();
    std::uint8_t& cell =
        first_near_[static_cast<std::size_t>((at[0] * kSide + at[1]) * kSide + at[2])];
    if (is_first) cell = 1;
    same += cell;
  }
  const double count = static_cast<double>(indices.size());
  done_ = done_ || static_cast<double>(same) < kMinFraction * count;
  const Pose moved = first_pose_->inverse() * T_world_sensor;
  const bool has_moved =
      moved.translation().norm() > kNear || rotationAngle(moved.linear()) > kMinTurn;
  if (done_ || !has_moved) return false;
  done_ = true;
  return true;
}

}  // namespace planar_mapping::detail
