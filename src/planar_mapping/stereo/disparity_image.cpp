// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/disparity_image.h"

#include <cmath>
#include <limits>

#include "planar_mapping/base/simd.h"
#include "planar_mapping/stereo/cv_image.h"

namespace planar_mapping {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Disparity below which a point is at infinity, pixels: beyond, a float says nothing any more.
constexpr float kInfinity = 1e-3f;

PLANAR_MAPPING_MULTIVERSION
void triangulateRow(const float* disparity, const float* column_slope, float row_slope,
                    float depth_of_one, float shift, int width, float* xyz) {
  for (int column = 0; column < width; ++column) {
    const float d = disparity[column] + shift;
    const float z = d > kInfinity ? depth_of_one / d : kNaN;
    xyz[3 * column + 0] = column_slope[column] * z;
    xyz[3 * column + 1] = row_slope * z;
    xyz[3 * column + 2] = z;
  }
}

}  // namespace

double DisparityImage::density() const {
  if (values.empty()) return 0.0;
  std::size_t valid = 0;
  for (const float value : values) valid += std::isnan(value) ? 0 : 1;
  return static_cast<double>(valid) / static_cast<double>(values.size());
}

void triangulate(const DisparityImage& disparity, const io::Calibration& calibration,
                 std::vector<float>& xyz) {
  detail::requireStereo(calibration, disparity.width, disparity.height);
  if (disparity.values.size() !=
      static_cast<std::size_t>(disparity.width) * static_cast<std::size_t>(disparity.height))
    throw InputError("the disparity image has other pixels than its size says");
  const PinholeCamera& camera = calibration.camera;
  const auto width = static_cast<std::size_t>(disparity.width);
  xyz.resize(3 * disparity.values.size());
  std::vector<float> column_slope(width);
  for (std::size_t column = 0; column < width; ++column) {
    column_slope[column] = static_cast<float>(camera.rayOf(static_cast<double>(column), 0.0).x());
  }
  const auto depth_of_one = static_cast<float>(camera.fx * *calibration.baseline);
  const auto shift = static_cast<float>(calibration.cx_right - camera.cx);
  for (int row = 0; row < disparity.height; ++row) {
    const std::size_t start = static_cast<std::size_t>(row) * width;
    triangulateRow(disparity.values.data() + start, column_slope.data(),
                   static_cast<float>(camera.rayOf(0.0, row).y()), depth_of_one, shift,
                   disparity.width, xyz.data() + 3 * start);
  }
}

}  // namespace planar_mapping
