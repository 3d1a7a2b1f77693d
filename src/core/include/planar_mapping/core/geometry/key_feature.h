// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>

#include "planar_mapping/core/base/types.h"

namespace planar_mapping {

/// A key feature of one frame: a place that is recognised in other frames, with its 3-D position
/// (the paper, III-B; METHOD section 1).
struct KeyFeature {
  std::int64_t track = -1;     ///< identity over frames, >= 0; a feature seen again keeps it
  std::int32_t sightings = 1;  ///< frames it was seen in so far, this one counted
  float column = std::numeric_limits<float>::quiet_NaN();     ///< pixels, left or only image
  float row = std::numeric_limits<float>::quiet_NaN();        ///< pixels
  float disparity = std::numeric_limits<float>::quiet_NaN();  ///< pixels; NaN without a stereo pair
  Vector3 position = Vector3::Zero();                         ///< sensor's frame, metres
};

}  // namespace planar_mapping
