// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "planar_mapping/localization/view_matching.h"

namespace planar_mapping::detail {

/// Where a frame is expected.
struct ExpectedPose {
  Pose T_now_map = Pose::Identity();
  double translation_sigma = 0.0;  ///< metres; 0 = nothing is expected
  double rotation_sigma = 0.0;     ///< radians
};

/// A pose of a frame by a local map, with all that speaks for it.
struct PoseCandidate {
  Pose T_now_map = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< see Matrix6
  /// The part of it that is independent of errors of other frames.
  Matrix6 independent = Matrix6::Zero();
  PoseEvidence evidence;
  bool by_features = false;
};

/// The pose near the expected one, by optical flow and surfaces: fast. None where it is not certain
/// (odds of 20 : 1). The frame needs no features.
std::optional<PoseCandidate> trackPose(const LocalMap& map, const View& now,
                                       const ExpectedPose& expected);

/// The likeliest pose that features and surfaces suggest; none where nothing suggests any.
/// \param frame_gap  frames between the frame and the nearest view of the map, 1 = neighbours
std::optional<PoseCandidate> searchPose(const LocalMap& map, const View& now,
                                        const ExpectedPose& expected, int frame_gap);

}  // namespace planar_mapping::detail
