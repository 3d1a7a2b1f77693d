// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "keys/noise_keys.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/pipeline/parameter.h"

namespace planar_mapping::detail {

/// The parameters of the map, and what `auto` among them means for an input.
struct MapKeys {
  PlanarMapParams params;
  NoiseKeys noise;
  std::optional<double> resolution = 0.1;  ///< auto = none

  void applyProfile(Profile profile);
  void declare(ParameterTable& table);
  /// \throws ParameterError
  void configure(int threads);
  /// Resolves `auto` from the first frame.
  /// \throws InputError if its coordinates are too coarse for the cells
  void adapt(const CloudScale& scale);

 private:
  enum class UnknownSpace : std::uint8_t { Auto, Yes, No };

  double withinLimit(double range) const;

  UnknownSpace unknown_space = UnknownSpace::Auto;
  std::optional<double> association_offset;
  std::optional<double> association_gap;
  std::optional<double> max_range;
  std::optional<double> miss_range;
  std::optional<Vector3> up = Vector3::UnitZ();
};

}  // namespace planar_mapping::detail
