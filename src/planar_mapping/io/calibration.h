// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "planar_mapping/base/export.h"
#include "planar_mapping/geometry/camera.h"

namespace planar_mapping::io {

/// Radial (k) and tangential (p) distortion of a lens, of a ray (x, y, 1) with r^2 = x^2 + y^2:
/// x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and y' likewise with
/// p1 (r^2 + 2 y^2) + 2 p2 x y (Brown; what OpenCV calls k1 k2 p1 p2 k3).
struct LensDistortion {
  double k1 = 0.0;
  double k2 = 0.0;
  double p1 = 0.0;
  double p2 = 0.0;
  double k3 = 0.0;
};

/// What has to be known of a stereo pair that is not rectified yet.
struct UnrectifiedPair {
  LensDistortion left;
  LensDistortion right;
  PinholeCamera right_camera;            ///< of the same size as the left one
  Pose T_right_left = Pose::Identity();  ///< maps points of the left camera into the right one
};

/// The calib.yaml of a sequence folder.
///
/// image_width, image_height (pixels), fx, fy, cx, cy (pixels, pixel centres at integers); stereo:
/// baseline_m and, where it differs from cx, cx_right; RGB-D: depth_scale (metres = value /
/// depth_scale), and depth_along: ray where these are distances along the rays of the pixels and
/// not depths along the axis of the camera.
///
/// A pair that is not rectified has, in place of baseline_m: rotation (9 numbers, row by row) and
/// translation_m (3 numbers), which map points of the left camera into the right one; k1, k2, p1,
/// p2, k3 of the left lens and k1_right, ... of the right one, 0 where not given; fx_right,
/// fy_right, cx_right, cy_right, as the left ones where not given. An RGB-D camera may have k1 ...
/// k3 too; its images are undistorted when they are read.
struct Calibration {
  PinholeCamera camera;
  std::optional<double> baseline;  ///< metres
  double cx_right = 0.0;           ///< pixels; = camera.cx where the file does not say
  std::optional<double> depth_scale;
  bool depth_along_ray = false;
  std::optional<LensDistortion> distortion;    ///< of RGB-D images
  std::optional<UnrectifiedPair> unrectified;  ///< the images have to be rectified first
};

/// \throws IoError naming file and line: missing, repeated, unknown or mistyped key, value out of
/// range
PLANAR_MAPPING_EXPORT Calibration readCalibration(const std::string& path);

/// The text readCalibration() reads, the same for every locale.
PLANAR_MAPPING_EXPORT std::string toYaml(const Calibration& calibration);

}  // namespace planar_mapping::io
