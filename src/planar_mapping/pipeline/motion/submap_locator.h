// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "planar_mapping/localization/localizer.h"
#include "planar_mapping/pipeline/frame.h"

namespace planar_mapping::detail {

/// Poses of frames with an image and an organized cloud by Localizer, in the world of the first
/// submap.
class SubmapLocator {
 public:
  /// Sets pose and motion of the frame, or the reason why it has none in this world.
  /// \param T_world_start    of the first frame
  /// \param step_covariance  of the step between given poses; null: they are not looked at
  void place(Frame& frame, const Pose& T_world_start, const Matrix6* step_covariance);
  bool started() const { return localizer_.has_value(); }

 private:
  std::optional<Localizer> localizer_;
  Pose T_world_start_ = Pose::Identity();
  std::optional<Pose> last_pose_;
};

}  // namespace planar_mapping::detail
