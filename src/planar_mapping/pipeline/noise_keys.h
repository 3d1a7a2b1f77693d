// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "planar_mapping/geometry/camera.h"
#include "planar_mapping/geometry/cloud_scale.h"
#include "planar_mapping/pipeline/parameter.h"

namespace planar_mapping::detail {

/// The keys of the stereo noise that stages have in common.
class NoiseKeys {
 public:
  enum class Source : std::uint8_t { None, Given, Auto };

  /// baseline_m, focal_length_px and disparity_error_px.
  void declare(ParameterTable& table);
  /// And `noise`, for stages that can do without.
  /// \param use what the noise does to the stage
  void declareOptional(ParameterTable& table, const char* use);
  /// Resolves `auto` from the first frame.
  void adapt(const CloudScale& scale);
  void setSource(Source source) { source_ = source; }
  /// Nothing where there is none to use; before adapt() nothing for `auto`.
  std::optional<StereoNoise> optionalNoise() const;
  /// With the values of StereoNoise for what neither the file nor the input says.
  StereoNoise noise() const;

 private:
  Source source_ = Source::Auto;
  std::optional<double> baseline_;
  std::optional<double> focal_length_;
  double disparity_error_ = StereoNoise().disparity_error;
};

}  // namespace planar_mapping::detail
