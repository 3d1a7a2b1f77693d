// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "layouts/undistortion.h"

#include <cmath>

namespace planar_mapping::io::layouts {

Undistorter::Undistorter(const PinholeCamera& camera, const LensDistortion& lens)
    : width_(camera.width), height_(camera.height) {
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      const double x = (column - camera.cx) / camera.fx, y = (row - camera.cy) / camera.fy;
      const double r2 = x * x + y * y;
      const double radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
      const double from_x = x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x);
      const double from_y = y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y;
      const double u = camera.fx * from_x + camera.cx, v = camera.fy * from_y + camera.cy;
      const bool is_inside = u >= 0.0 && v >= 0.0 && u <= width_ - 1 && v <= height_ - 1;
      columns_.push_back(is_inside ? static_cast<float>(u) : -1.0f);
      rows_.push_back(is_inside ? static_cast<float>(v) : -1.0f);
    }
  }
}

DepthImage Undistorter::undistorted(const DepthImage& image) const {
  if (image.values.size() != columns_.size() || static_cast<int>(image.width) != width_) {
    return image;
  }
  DepthImage out{image.width, image.height, std::vector<std::uint16_t>(columns_.size(), 0)};
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (columns_[i] < 0.0f) continue;
    const auto column = static_cast<std::size_t>(columns_[i] + 0.5f);
    const auto row = static_cast<std::size_t>(rows_[i] + 0.5f);
    out.values[i] = image.values[row * image.width + column];
  }
  return out;
}

Image Undistorter::undistorted(const Image& image) const {
  if (image.width != width_ || image.height != height_) return image;
  Image out = image;
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto stride = static_cast<std::size_t>(width_) * channels;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const bool is_inside = columns_[i] >= 0.0f;
    const auto column = static_cast<std::size_t>(is_inside ? columns_[i] : 0.0f);
    const auto row = static_cast<std::size_t>(is_inside ? rows_[i] : 0.0f);
    const float a = columns_[i] - static_cast<float>(column);
    const float b = rows_[i] - static_cast<float>(row);
    const std::size_t right = static_cast<int>(column) + 1 < width_ ? channels : 0;
    const std::size_t below = static_cast<int>(row) + 1 < height_ ? stride : 0;
    for (std::size_t c = 0; c < channels; ++c) {
      const std::uint8_t* p = &image.pixels[row * stride + column * channels + c];
      const float value = (1.0f - b) * ((1.0f - a) * p[0] + a * p[right]) +
                          b * ((1.0f - a) * p[below] + a * p[below + right]);
      out.pixels[i * channels + c] = is_inside ? static_cast<std::uint8_t>(value + 0.5f) : 0;
    }
  }
  return out;
}

}  // namespace planar_mapping::io::layouts
