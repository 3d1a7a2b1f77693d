// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/io/depth_image.h"

#include <cmath>
#include <limits>
#include <type_traits>

#include "planar_mapping/base/error.h"
#include "planar_mapping/base/simd.h"

namespace planar_mapping::io {
namespace {

template <typename Value>
PLANAR_MAPPING_INLINE void projectRowOf(const Value* values, const float* column_slope,
                                        float row_slope, float metres_per_unit, std::uint32_t width,
                                        float* xyz) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  // All bits of a count are set where a camera or a data set says that there is none.
  constexpr float kLargest = std::is_same_v<Value, std::uint16_t>
                                 ? std::numeric_limits<std::uint16_t>::max() - 1
                                 : std::numeric_limits<float>::max();
  for (std::uint32_t column = 0; column < width; ++column) {
    const auto value = static_cast<float>(values[column]);
    const float z = value > 0.0f && value <= kLargest ? value * metres_per_unit : kNaN;
    xyz[3 * column + 0] = column_slope[column] * z;
    xyz[3 * column + 1] = row_slope * z;
    xyz[3 * column + 2] = z;
  }
}

PLANAR_MAPPING_MULTIVERSION
void projectRow(const std::uint16_t* values, const float* column_slope, float row_slope,
                float metres_per_unit, std::uint32_t width, float* xyz) {
  projectRowOf(values, column_slope, row_slope, metres_per_unit, width, xyz);
}

PLANAR_MAPPING_MULTIVERSION
void projectRow(const float* values, const float* column_slope, float row_slope,
                float metres_per_unit, std::uint32_t width, float* xyz) {
  projectRowOf(values, column_slope, row_slope, metres_per_unit, width, xyz);
}

}  // namespace

DepthProjector::DepthProjector(const PinholeCamera& camera, double depth_scale, bool along_ray)
    : along_ray_(along_ray) {
  requireInRange("image_width", camera.width, 1, std::numeric_limits<int>::max(), "px");
  requireInRange("image_height", camera.height, 1, std::numeric_limits<int>::max(), "px");
  requirePositive("fx", camera.fx, "px");
  requirePositive("fy", camera.fy, "px");
  requirePositive("depth_scale", depth_scale);
  width_ = static_cast<std::uint32_t>(camera.width);
  height_ = static_cast<std::uint32_t>(camera.height);
  metres_per_unit_ = static_cast<float>(1.0 / depth_scale);
  for (std::uint32_t column = 0; column < width_; ++column)
    column_slope_.push_back(static_cast<float>(camera.rayOf(column, 0.0).x()));
  for (std::uint32_t row = 0; row < height_; ++row)
    row_slope_.push_back(static_cast<float>(camera.rayOf(0.0, row).y()));
}

void DepthProjector::project(const DepthImage& image, CloudData& cloud) const {
  if (image.width != width_ || image.height != height_ ||
      image.values.size() != std::size_t{width_} * height_)
    throw InputError("the depth image is " + std::to_string(image.width) + " x " +
                     std::to_string(image.height) + " pixels, its camera " +
                     std::to_string(width_) + " x " + std::to_string(height_));
  projectImage(image.values.data(), cloud);
}

void DepthProjector::project(const float* values, CloudData& cloud) const {
  projectImage(values, cloud);
}

template <typename Value>
void DepthProjector::projectImage(const Value* values, CloudData& cloud) const {
  cloud.width = width_;
  cloud.height = height_;
  cloud.xyz.resize(3 * std::size_t{width_} * height_);
  cloud.colors.clear();
  cloud.labels.clear();
  cloud.intensities.clear();
  for (std::size_t row = 0; row < height_; ++row)
    projectRow(values + row * width_, column_slope_.data(), row_slope_[row], metres_per_unit_,
               width_, cloud.xyz.data() + 3 * row * width_);
  if (!along_ray_) return;
  for (std::size_t i = 0; i < std::size_t{width_} * height_; ++i) {
    const float x = column_slope_[i % width_];
    const float y = row_slope_[i / width_];
    const float z = 1.0f / std::sqrt(1.0f + x * x + y * y);
    for (std::size_t k = 0; k < 3; ++k) cloud.xyz[3 * i + k] *= z;
  }
}

}  // namespace planar_mapping::io
