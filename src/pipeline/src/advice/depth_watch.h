// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/base/types.h"

namespace planar_mapping::detail {

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

}  // namespace planar_mapping::detail
