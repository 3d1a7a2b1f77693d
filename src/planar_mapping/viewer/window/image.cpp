// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/viewer/window/image.h"

#include <algorithm>
#include <cstdlib>

#include "planar_mapping/base/error.h"

namespace planar_mapping {

Color colorAt(const Image& image, int column, int row) {
  const std::size_t pixel = static_cast<std::size_t>(row) * image.width + column;
  const std::uint8_t* p = &image.pixels[3 * pixel];
  return {p[0], p[1], p[2]};
}

bool isBlank(const Image& image, int tolerance) {
  for (std::size_t i = 3; i < image.pixels.size(); ++i) {
    if (std::abs(image.pixels[i] - image.pixels[i % 3]) > tolerance) return false;
  }
  return true;
}

ImageDifference compareImages(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height)
    throw InputError("the pictures differ in size: " + std::to_string(a.width) + "x" +
                     std::to_string(a.height) + " and " + std::to_string(b.width) + "x" +
                     std::to_string(b.height));
  ImageDifference difference;
  if (a.pixels.empty()) return difference;
  double sum = 0.0;
  std::size_t changed = 0;
  for (std::size_t i = 0; i < a.pixels.size(); i += 3) {
    int largest = 0;
    for (std::size_t k = i; k < i + 3; ++k) {
      const int apart = std::abs(a.pixels[k] - b.pixels[k]);
      sum += apart;
      largest = std::max(largest, apart);
    }
    if (largest > 16) ++changed;
  }
  difference.mean = sum / (255.0 * static_cast<double>(a.pixels.size()));
  difference.changed = static_cast<double>(changed) / (static_cast<double>(a.pixels.size()) / 3.0);
  return difference;
}

Image readPng(const std::string& path) {
  const Image file = io::readImage(path);
  if (file.channels == 3) return file;
  Image image{file.width, file.height, 3, {}};
  for (const std::uint8_t gray : file.pixels) image.pixels.insert(image.pixels.end(), 3, gray);
  return image;
}

}  // namespace planar_mapping
