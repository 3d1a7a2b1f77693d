// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "planar_mapping/base/export.h"
#include "planar_mapping/io/calibration.h"

namespace planar_mapping {

/// Disparity of each pixel of the left image, row by row: column in the left minus column in the
/// right image, pixels; NaN = none.
struct DisparityImage {
  int width = 0;
  int height = 0;
  std::vector<float> values;

  float at(int column, int row) const {
    return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(column)];
  }
  /// Fraction of the pixels that have a disparity; 0 for an empty image.
  PLANAR_MAPPING_EXPORT double density() const;
};

/// Points of the left camera's frame, metres: Z = fx B / (d + cx_right - cx),
/// X = (column - cx) Z / fx, Y = (row - cy) Z / fy. NaN where there is no disparity or the point
/// would be at infinity or behind the camera.
/// \param xyz  organized as the image, three floats a point; resized
/// \throws InputError if the calibration has no baseline or another image size
PLANAR_MAPPING_EXPORT void triangulate(const DisparityImage& disparity,
                                       const io::Calibration& calibration, std::vector<float>& xyz);

}  // namespace planar_mapping
