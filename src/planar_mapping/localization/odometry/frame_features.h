// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "planar_mapping/localization/odometry/odometry.h"

namespace planar_mapping::detail {

/// A feature of a frame that can be used.
struct SeenFeature {
  std::size_t feature = 0;  ///< its number in the frame
  std::int64_t track = 0;
  FeatureSighting sighting;
};

/// Features with a usable position and a track of their own, by track.
std::vector<SeenFeature> usableFeatures(const std::vector<KeyFeature>& features,
                                        const FeatureCamera& camera);
/// Why features do not fix a pose, a sentence without full stop; of a motion that was found and is
/// not believed, see OdometryParams::jump_distance.
std::string reasonFor(const MotionEstimate& estimate, std::size_t features, std::size_t matches,
                      const MotionParams& params);
/// \throws InputError for a feature without a track
void requireTracks(const std::vector<KeyFeature>& features);

}  // namespace planar_mapping::detail
