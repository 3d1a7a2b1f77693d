// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "planar_mapping/io/image_file.h"

namespace planar_mapping::test {

/// Boxes of random size, depth and gray in front of a wall, in noise.
class Boxes {
 public:
  static constexpr int kWidth = 320;
  static constexpr int kHeight = 240;

  explicit Boxes(unsigned seed) : random_(seed) {
    std::uniform_real_distribution<double> place(-0.7, 0.7);
    std::uniform_real_distribution<double> size(0.05, 0.2);
    std::uniform_real_distribution<double> depth(1.0, 2.5);
    std::uniform_int_distribution<int> gray(20, 230);
    for (int i = 0; i < 25; ++i)
      boxes_.push_back({place(random_), place(random_), size(random_), size(random_),
                        depth(random_), gray(random_)});
  }

  std::vector<float> cloud() {
    std::vector<float> xyz;
    for (int row = 0; row < kHeight; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        const double depth = at(column, row, 1.0, 0.0).depth;
        xyz.insert(xyz.end(), {0.0f, 0.0f, static_cast<float>(depth)});
      }
    }
    return xyz;
  }
  /// What a camera sees whose image is that of the depth, scaled about its middle and shifted.
  io::Image image(double scale, double shift, double noise) {
    std::normal_distribution<double> error(0.0, noise);
    io::Image image;
    image.width = kWidth;
    image.height = kHeight;
    image.channels = 1;
    for (int row = 0; row < kHeight; ++row)
      for (int column = 0; column < kWidth; ++column)
        image.pixels.push_back(static_cast<std::uint8_t>(
            std::clamp(at(column, row, scale, shift).gray + error(random_), 0.0, 255.0)));
    return image;
  }

 private:
  struct Box {
    double x, y, half_width, half_height, depth;
    int gray;
  };
  Box at(int column, int row, double scale, double shift) const {
    const double x = (column - shift - 0.5 * kWidth) / scale / (0.5 * kWidth);
    const double y = (row - 0.5 * kHeight) / scale / (0.5 * kWidth);
    Box seen{0.0, 0.0, 0.0, 0.0, 4.0, 128};
    for (const Box& box : boxes_)
      if (std::abs(x - box.x) < box.half_width && std::abs(y - box.y) < box.half_height &&
          box.depth < seen.depth)
        seen = box;
    return seen;
  }

  std::mt19937 random_;
  std::vector<Box> boxes_;
};

}  // namespace planar_mapping::test
