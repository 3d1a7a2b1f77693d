// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "planar_mapping/pipeline/advice/watches.h"
#include "planar_mapping/pipeline/frame_source.h"
#include "planar_mapping/pipeline/pipeline.h"
#include "planar_mapping/pipeline/run_statistics.h"

namespace planar_mapping::detail {

/// What a run has to say of its frames, each thing once.
class FrameWatch {
 public:
  /// \pre the frame is in the map
  std::vector<std::string> adviceOn(const Frame& frame, const PlanarMap& map);
  /// Whether the first frame is a camera's view.
  bool isCamera() const { return is_camera_.value_or(false); }

  template <typename Archive>
  void visitState(Archive& archive) {
    archive(robot_, poses_, depths_, is_camera_, last_place_, last_reach_, is_apart_);
  }

 private:
  std::optional<std::string> apart(const Frame& frame, const PointsView& points);

  RobotWatch robot_;
  PoseWatch poses_;
  DepthWatch depths_;
  std::optional<bool> is_camera_;      ///< by the first frame
  std::optional<Vector3> last_place_;  ///< of the sensor, as given
  double last_reach_ = 0.0;            ///< of its points, metres
  bool is_apart_ = false;              ///< that was said
};

/// What a finished run has to say of its result, a sentence each, and what helps.
/// \pre a frame was used
std::vector<std::string> adviceOn(const Pipeline& pipeline, const RunStatistics& statistics,
                                  const FrameSource& source, bool is_camera);

}  // namespace planar_mapping::detail
