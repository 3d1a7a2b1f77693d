// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "keys/noise_keys.h"
#include "planar_mapping/core/occupancy/kl_occupancy.h"
#include "planar_mapping/pipeline/stage.h"

namespace planar_mapping::detail {

/// The parameters of kl_occupancy, and what `auto` among them means for an input.
struct BeliefKeys {
  KlOccupancyParams params;

  void applyProfile(Profile profile);
  void declare(ParameterTable& table);
  /// \throws ParameterError
  void configure(const RunSettings& settings);
  /// Resolves `auto` from the first frame.
  void adapt(const CloudScale& scale);

 private:
  std::optional<double> resolution = params.resolution;
  NoiseKeys noise;
};

}  // namespace planar_mapping::detail
