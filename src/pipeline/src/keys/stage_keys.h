// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "planar_mapping/core/geometry/camera.h"
#include "planar_mapping/core/occupancy/kl_occupancy.h"
#include "planar_mapping/core/planes/multi_plane.h"
#include "planar_mapping/map/planar_map.h"
#include "planar_mapping/pipeline/frame.h"
#include "planar_mapping/pipeline/parameter.h"
#include "planar_mapping/pipeline/stage.h"

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
