// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "keys/noise_keys.h"
#include "motion/start_pose.h"
#include "planar_mapping/core/odometry/odometry.h"
#include "planar_mapping/core/registration/detail/surface_map.h"
#include "planar_mapping/pipeline/parameter.h"

namespace planar_mapping::detail {

/// The parameters of motion_estimation.
struct MotionKeys {
  enum class Poses : std::uint8_t { Use, Prior, Ignore };
  enum class Clouds : std::uint8_t { Auto, On, Off };

  void declare(ParameterTable& table);
  /// \throws ParameterError
  void configure(std::uint64_t seed);

  OdometryParams odometry;
  Poses poses = Poses::Use;
  StartPose start;
  double given_position_error = 0.02;
  double given_orientation_error = 0.01;
  double depth_error = 0.003;
  double depth_error_growth = 0.002;
  NoiseKeys noise;
  Clouds clouds = Clouds::Auto;
  int enough_inliers = 60;
  SurfaceMapParams surface;
  std::optional<double> cloud_cell;
  std::optional<double> cloud_reach;

 private:
  void declareSearch(ParameterTable& table);
  void declareClouds(ParameterTable& table);
};

}  // namespace planar_mapping::detail
