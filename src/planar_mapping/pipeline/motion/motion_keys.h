// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "planar_mapping/localization/localizer.h"
#include "planar_mapping/localization/registration/surface_map.h"
#include "planar_mapping/pipeline/frame.h"
#include "planar_mapping/pipeline/noise_keys.h"
#include "planar_mapping/pipeline/parameter.h"

namespace planar_mapping::detail {

/// Pose of the first frame where none is given or used.
class StartPose {
 public:
  /// start and camera_height_m.
  void declare(ParameterTable& table);
  /// \param optical  the frame of the cloud is a camera's, z forward; else x forward, z up
  /// \param frame    gets notes about what was found
  Pose of(Frame& frame, bool optical, const std::optional<StereoNoise>& noise) const;
  /// Whether a pose that is given is the start, and the world that of the given poses.
  bool isGiven() const { return start_ == Start::Given; }

 private:
  enum class Start : std::uint8_t { Auto, Level, Identity, Given, Ground };

  void levelByPlanes(Frame& frame, const std::optional<StereoNoise>& noise, Pose& pose) const;
  void levelByGround(Frame& frame, bool optical, const std::optional<StereoNoise>& noise,
                     Pose& pose) const;

  Start start_ = Start::Auto;
  double camera_height_ = 0.37;
};

/// The parameters of motion_estimation.
struct MotionKeys {
  enum class Poses : std::uint8_t { Use, Prior, Ignore };

  void declare(ParameterTable& table);
  /// \throws ParameterError
  void configure();
  /// What is `auto` becomes what suits a camera, or a scanner.
  void adapt(bool is_optical);
  /// Of images; with the noise of a pair after adapt().
  LocalizerParams localizerNow() const;
  /// Of clouds without images, by the first one.
  SurfaceMapParams surfaceFor(const Frame& frame) const;

  Poses poses = Poses::Use;
  StartPose start;
  double given_position_error = 0.02;
  double given_orientation_error = 0.01;
  NoiseKeys noise;
  LocalizerParams localizer;
  SurfaceMapParams surface;
  std::optional<double> depth_error;
  std::optional<double> depth_error_growth;
  std::optional<double> cloud_min_fraction;
  std::optional<double> cloud_cell;
  std::optional<double> cloud_reach;
};

}  // namespace planar_mapping::detail
