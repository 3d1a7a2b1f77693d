// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/pipeline/noise_keys.h"

namespace planar_mapping::detail {

void NoiseKeys::declare(ParameterTable& table) {
  table.number("baseline_m", baseline_, Range::positive(),
               "B of the noise model; auto = of calib.yaml, else 0.12");
  table.number("focal_length_px", focal_length_, Range::positive(),
               "f of the noise model; auto = of calib.yaml, else 500");
  table.number("disparity_error_px", disparity_error_, Range::atLeast(0.0),
               "dd of the noise model");
}

void NoiseKeys::declareOptional(ParameterTable& table, const char* use) {
  table.word("noise", source_,
             {{"auto", Source::Auto}, {"none", Source::None}, {"given", Source::Given}},
             std::string("[ours] ") + use +
                 "; none, given = by the next three keys, auto = given if the input has a stereo "
                 "calibration, else none");
  declare(table);
}

void NoiseKeys::adapt(const CloudScale& scale) {
  if (source_ == Source::Auto) source_ = scale.stereo ? Source::Given : Source::None;
  const StereoNoise known = scale.stereo.value_or(StereoNoise());
  if (!baseline_) baseline_ = known.baseline;
  if (!focal_length_) focal_length_ = known.focal_length;
}

std::optional<StereoNoise> NoiseKeys::optionalNoise() const {
  if (source_ != Source::Given) return std::nullopt;
  return noise();
}

StereoNoise NoiseKeys::noise() const {
  StereoNoise noise;
  noise.baseline = baseline_.value_or(noise.baseline);
  noise.focal_length = focal_length_.value_or(noise.focal_length);
  noise.disparity_error = disparity_error_;
  return noise;
}

}  // namespace planar_mapping::detail
