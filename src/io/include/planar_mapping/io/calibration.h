// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "planar_mapping/core/export.h"
#include "planar_mapping/map/planar_map.h"

namespace planar_mapping {
namespace io {

/// The calib.yaml of a sequence folder.
///
/// image_width, image_height (pixels), fx, fy, cx, cy (pixels, pixel centres at integers); stereo:
/// baseline_m and, where it differs from cx, cx_right; RGB-D: depth_scale (metres = value /
/// depth_scale).
struct Calibration {
  PinholeCamera camera;
  std::optional<double> baseline;  ///< metres
  double cx_right = 0.0;           ///< pixels; = camera.cx where the file does not say
  std::optional<double> depth_scale;
};

/// \throws IoError naming file and line: missing, repeated, unknown or mistyped key, value out of
/// range
PLANAR_MAPPING_EXPORT Calibration readCalibration(const std::string& path);

/// The text readCalibration() reads, the same for every locale.
PLANAR_MAPPING_EXPORT std::string toYaml(const Calibration& calibration);

}  // namespace io
}  // namespace planar_mapping
