// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "planar_mapping/io/calibration.h"
#include "planar_mapping/io/image_file.h"

namespace planar_mapping {

/// A smooth random pattern that can be asked for anywhere, so that images of it can be made with
/// exactly known sub-pixel shifts.
class Pattern {
 public:
  explicit Pattern(std::uint32_t seed = 1) : seed_(seed) {}

  /// In [0, 255]; details of about `finest` pixels.
  double operator()(double x, double y) const {
    double sum = 0.0;
    double weight = 1.0;
    double weights = 0.0;
    for (const double cell : {6.0, 12.0, 40.0}) {
      sum += weight * valueNoise(x / cell, y / cell, static_cast<std::uint32_t>(cell));
      weights += weight;
      weight *= 0.8;
    }
    // Noise of several octaves crowds around its mean; spread it.
    return std::clamp(128.0 + 360.0 * (sum / weights - 0.5), 0.0, 255.0);
  }

 private:
  double lattice(std::int64_t x, std::int64_t y, std::uint32_t octave) const {
    auto h = static_cast<std::uint32_t>(x) * 0x8DA6B343u ^
             static_cast<std::uint32_t>(y) * 0xD8163841u ^ (octave + 131u * seed_) * 0xCB1AB31Fu;
    h ^= h >> 15u;
    h *= 0x2C1B3C6Du;
    h ^= h >> 12u;
    h *= 0x297A2D39u;
    h ^= h >> 15u;
    return h / 4294967296.0;
  }
  double valueNoise(double x, double y, std::uint32_t octave) const {
    const double fx = std::floor(x);
    const double fy = std::floor(y);
    const auto ix = static_cast<std::int64_t>(fx);
    const auto iy = static_cast<std::int64_t>(fy);
    const auto smooth = [](double t) { return t * t * t * (t * (6.0 * t - 15.0) + 10.0); };
    const double sx = smooth(x - fx);
    const double sy = smooth(y - fy);
    const double top = lattice(ix, iy, octave) * (1.0 - sx) + lattice(ix + 1, iy, octave) * sx;
    const double bottom =
        lattice(ix, iy + 1, octave) * (1.0 - sx) + lattice(ix + 1, iy + 1, octave) * sx;
    return top * (1.0 - sy) + bottom * sy;
  }

  std::uint32_t seed_;
};

/// A gray image of value(column, row).
template <typename Value>
io::Image paint(int width, int height, const Value& value) {
  io::Image image;
  image.width = width;
  image.height = height;
  image.channels = 1;
  image.pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      image.pixels.push_back(
          static_cast<std::uint8_t>(std::lround(std::clamp(value(column, row), 0.0, 255.0))));
    }
  }
  return image;
}

inline io::Image uniform(int width, int height, double value) {
  return paint(width, height, [value](int, int) { return value; });
}

/// Disparity of a slanted plane, d = offset + by_column x + by_row y over the left image.
struct DisparityPlane {
  double offset = 0.0;
  double by_column = 0.0;
  double by_row = 0.0;

  double at(double column, double row) const { return offset + by_column * column + by_row * row; }
};

struct ImagePair {
  io::Image left;
  io::Image right;
};

/// Both views of a plane that carries the pattern, moved by (shift_x, shift_y) in the left image.
inline ImagePair pairOf(const Pattern& pattern, const DisparityPlane& plane, int width, int height,
                        double shift_x = 0.0, double shift_y = 0.0) {
  ImagePair pair;
  pair.left = paint(width, height,
                    [&](int column, int row) { return pattern(column + shift_x, row + shift_y); });
  pair.right = paint(width, height, [&](int column, int row) {
    // The left column x that is seen here: x - d(x, row) = column.
    const double x = (column + plane.offset + plane.by_row * row) / (1.0 - plane.by_column);
    return pattern(x + shift_x, row + shift_y);
  });
  return pair;
}

/// f = 300 px, B = 0.1 m: Z = 30 / d.
inline io::Calibration pairCalibration(int width, int height) {
  io::Calibration calibration;
  calibration.camera.width = width;
  calibration.camera.height = height;
  calibration.camera.fx = calibration.camera.fy = 300.0;
  calibration.camera.cx = calibration.cx_right = 0.5 * (width - 1);
  calibration.camera.cy = 0.5 * (height - 1);
  calibration.baseline = 0.1;
  return calibration;
}

}  // namespace planar_mapping

// Walls of patches, for images made ray by ray.
namespace planar_mapping::test {

/// In [0, 1].
inline double noiseAt(std::int64_t u, std::int64_t v, std::uint64_t seed) {
  std::uint64_t h = static_cast<std::uint64_t>(u) * 0x9E3779B97F4A7C15ULL ^
                    static_cast<std::uint64_t>(v) * 0xC2B2AE3D27D4EB4FULL ^ (seed << 40u);
  h = (h ^ h >> 29u) * 0xBF58476D1CE4E5B9ULL;
  return static_cast<double>((h ^ h >> 32u) & 0xFFFFu) / 65535.0;
}

/// Patches of 7 and of 2.5 cm; \p period repeats them along x, metres, 0 = never.
inline double wallTone(double x, double y, double period, std::uint64_t seed) {
  if (period > 0.0) x -= period * std::floor(x / period);
  const auto patch = [&](double side, std::uint64_t layer) {
    return noiseAt(std::lround(std::floor(x / side)), std::lround(std::floor(y / side)),
                   seed + layer);
  };
  return 60.0 + 80.0 * patch(0.07, 1) + 60.0 * patch(0.025, 2);
}

}  // namespace planar_mapping::test
