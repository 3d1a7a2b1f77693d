// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "planar_mapping/pipeline/parameter.h"
#include "planar_mapping/stereo/cloud_features.h"
#include "planar_mapping/stereo/feature_tracker.h"
#include "planar_mapping/stereo/stereo_matcher.h"

namespace planar_mapping::detail {

/// The parameters of stereo_matching.
struct StereoKeys {
  StereoMatcherParams matcher;
  double min_brightness = 4.0;
  double min_density = 0.02;

  void declare(ParameterTable& table);
};

/// The parameters of key_features.
struct FeatureKeys {
  enum class Source : std::uint8_t { Auto, Image, Cloud };
  enum class Registered : std::uint8_t { Auto, Yes, No };

  Source source = Source::Auto;
  Registered registered = Registered::Auto;
  FeatureTrackerParams tracker;
  CloudFeatureParams sampler;

  void declare(ParameterTable& table);
  /// \throws ParameterError
  void configure(int threads);
};

}  // namespace planar_mapping::detail
