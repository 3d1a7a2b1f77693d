// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "keys/noise_keys.h"
#include "planar_mapping/core/planes/multi_plane.h"
#include "planar_mapping/pipeline/stage.h"

namespace planar_mapping::detail {

/// The parameters of multi_plane_segmentation, and what `auto` among them means for an input.
struct PlaneKeys {
  MultiPlaneParams params;
  double assumed_probability = 0.6;
  Vector3 up = Vector3::UnitZ();

  void applyProfile(Profile profile);
  void declare(ParameterTable& table);
  /// \throws ParameterError
  void configure(const RunSettings& settings);
  /// Resolves `auto` from the first frame.
  void adapt(const CloudScale& scale);

 private:
  std::optional<double> distance_threshold = 0.05;
  std::optional<int> min_inliers = 100;
  NoiseKeys noise;
};

}  // namespace planar_mapping::detail
