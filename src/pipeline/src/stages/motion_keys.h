// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "noise_keys.h"
#include "planar_mapping/core/odometry/odometry.h"
#include "planar_mapping/core/registration/detail/surface_map.h"
#include "planar_mapping/pipeline/parameter.h"
#include "start_pose.h"

namespace planar_mapping::detail {

/// The parameters of motion_estimation.
struct MotionKeys {
  enum class Poses : std::uint8_t { Use, Prior, Ignore };
  enum class Clouds : std::uint8_t { Auto, On, Off };

  void declareKeys(ParameterTable& table);
  /// \throws ParameterError
  void configureKeys(std::uint64_t seed);

  OdometryParams params_;
  Poses poses_ = Poses::Use;
  detail::StartPose start_;
  double given_position_error_ = 0.02;
  double given_orientation_error_ = 0.01;
  double depth_error_ = 0.003;
  double depth_error_growth_ = 0.002;
  detail::NoiseKeys noise_;
  Clouds clouds_ = Clouds::Auto;
  int enough_inliers_ = 60;
  SurfaceMapParams surface_params_;
  std::optional<double> cloud_cell_;
  std::optional<double> cloud_reach_;

 private:
  void declareSearch(ParameterTable& table);
  void declareClouds(ParameterTable& table);
};

}  // namespace planar_mapping::detail
