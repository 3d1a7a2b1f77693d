// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/core/geometry/camera.h"

#include <limits>

#include "planar_mapping/core/base/error.h"

namespace planar_mapping {

void StereoNoise::validate() const {
  requirePositive("baseline", baseline, "m");
  requirePositive("focal_length", focal_length, "px");
  requireInRange("disparity_error", disparity_error, 0.0, std::numeric_limits<double>::max(), "px");
}

}  // namespace planar_mapping
