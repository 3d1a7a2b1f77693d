// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/visualization/image.h"

#include <algorithm>
#include <cstdlib>

#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping {

Image::Image(int columns, int rows, Color fill) : width(columns), height(rows) {
  requireInRange("image width", columns, 1, 16384, "px");
  requireInRange("image height", rows, 1, 16384, "px");
  rgb.resize(3 * static_cast<std::size_t>(columns) * rows);
  for (std::size_t i = 0; i < rgb.size(); i += 3) {
    rgb[i] = fill.red;
    rgb[i + 1] = fill.green;
    rgb[i + 2] = fill.blue;
  }
}

Color Image::at(int column, int row) const {
  const std::uint8_t* p = rgb.data() + 3 * (static_cast<std::size_t>(row) * width + column);
  return {p[0], p[1], p[2]};
}

void Image::set(int column, int row, Color color) {
  std::uint8_t* p = rgb.data() + 3 * (static_cast<std::size_t>(row) * width + column);
  p[0] = color.red;
  p[1] = color.green;
  p[2] = color.blue;
}

bool isBlank(const Image& image, int tolerance) {
  for (std::size_t i = 3; i < image.rgb.size(); ++i) {
    if (std::abs(image.rgb[i] - image.rgb[i % 3]) > tolerance) return false;
  }
  return true;
}

ImageDifference compareImages(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height) {
    throw InputError("the pictures differ in size: " + std::to_string(a.width) + "x" +
                     std::to_string(a.height) + " and " + std::to_string(b.width) + "x" +
                     std::to_string(b.height));
  }
  ImageDifference difference;
  if (a.rgb.empty()) return difference;
  double sum = 0.0;
  std::size_t changed = 0;
  for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
    int largest = 0;
    for (std::size_t k = i; k < i + 3; ++k) {
      const int apart = std::abs(a.rgb[k] - b.rgb[k]);
      sum += apart;
      largest = std::max(largest, apart);
    }
    if (largest > 16) ++changed;
  }
  difference.mean = sum / (255.0 * static_cast<double>(a.rgb.size()));
  difference.changed = static_cast<double>(changed) / (static_cast<double>(a.rgb.size()) / 3.0);
  return difference;
}

Image readPng(const std::string& path) {
  io::Image file = io::readImage(path);
  Image image(file.width, file.height, Color{});
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    image.rgb[i] = file.pixels[file.channels == 3 ? i : i / 3];
  }
  return image;
}

void writePng(const Image& image, const std::string& path, bool overwrite) {
  io::writeImage(path, {image.width, image.height, 3, image.rgb},
                 overwrite ? io::Overwrite::Allow : io::Overwrite::Refuse);
}

}  // namespace planar_mapping
