// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planar_mapping/core/base/export.h"

namespace planar_mapping {

/// Depth error of a stereo camera, dz = z^2 / (B f) * dd (the paper, III-D).
struct PLANAR_MAPPING_EXPORT StereoNoise {
  double baseline = 0.12;         ///< B, metres, > 0
  double focal_length = 500.0;    ///< f, pixels, > 0
  double disparity_error = 0.5;   ///< dd, pixels, >= 0

  /// dz at depth \p z (metres).
  double depthError(double z) const {
    return z * z / (baseline * focal_length) * disparity_error;
  }
  /// \throws ParameterError
  void validate() const;
};

}  // namespace planar_mapping
