// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planar_mapping/pipeline/frame.h"
#include "planar_mapping/stereo/stereo_matcher.h"

namespace planar_mapping::detail {

/// Why the images are no pair; empty if they are. \throws InputError if the input has no pairs
std::string problemOf(const FrameImages& images);
/// Why the disparities of a pair are of no use; empty if they are.
std::string problemOf(const StereoReport& report, double min_brightness, double min_density);

}  // namespace planar_mapping::detail
