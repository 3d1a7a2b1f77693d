// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/pipeline/parameter.h"
#include "planar_mapping/stereo/stereo_matcher.h"

namespace planar_mapping::detail {

/// The parameters of stereo_matching.
struct StereoKeys {
  StereoMatcherParams matcher;
  double min_brightness = 4.0;
  double min_density = 0.02;

  void declare(ParameterTable& table);
};

}  // namespace planar_mapping::detail
