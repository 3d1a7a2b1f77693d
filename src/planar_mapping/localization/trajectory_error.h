// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/base/types.h"

namespace planar_mapping {

/// How far an estimated trajectory is off a reference. Metres and radians.
struct TrajectoryError {
  std::size_t poses = 0;
  double path_length = 0.0;  ///< of the reference
  /// Absolute trajectory error: distances between positions once the estimate was laid onto the
  /// reference by the best rigid motion (Umeyama without scale).
  double absolute_rms = 0.0;
  double absolute_max = 0.0;
  Pose T_reference_estimate = Pose::Identity();  ///< that motion
  /// Relative pose error from each pose to the next.
  double relative_translation_rms = 0.0;
  double relative_rotation_rms = 0.0;
  /// Error of the last pose relative to the first one.
  double end_translation = 0.0;
  double end_rotation = 0.0;

  /// end_translation in per cent of the path; 0 without a path.
  double endDriftPercent() const {
    return path_length > 0.0 ? 100.0 * end_translation / path_length : 0.0;
  }
};

/// Compares two trajectories pose by pose. O(poses).
/// \param estimate   T_world_sensor of each frame
/// \param reference  of the same frames; the two worlds may differ by a rigid motion
/// \return zeros for no poses. Where all positions are in a line or at a point, so that they do not
///         fix the rotation, the first poses are laid onto each other instead
/// \throws InputError for sizes that disagree or poses that are not finite
PLANAR_MAPPING_EXPORT TrajectoryError trajectoryError(const std::vector<Pose>& estimate,
                                                      const std::vector<Pose>& reference);

}  // namespace planar_mapping
