// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/features/surf_descriptor.h"

#include <algorithm>
#include <cmath>

#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

/// Where wavelets of one size are asked for: about the point, in steps of its scale.
struct Samples {
  double column, row;
  double cosine, sine;  ///< of the turned frame, times the step in pixels
  int half;             ///< side of a wavelet's halves, pixels
};

/// Differences of the sums of gray values of the right and the left, the lower and the upper half
/// of a square, whose middle is before the nearest pixel.
/// \param across, down  of each sample in the frame of the point
PLANAR_MAPPING_MULTIVERSION
void haarWavelets(const std::uint32_t* sums, int stride, Samples at, const float* across,
                  const float* down, int count, float* __restrict x, float* __restrict y) {
  const int half = at.half;
  const int below = half * stride;
  for (int i = 0; i < count; ++i) {
    const double u = at.cosine * double{across[i]} - at.sine * double{down[i]} + at.column;
    const double v = at.sine * double{across[i]} + at.cosine * double{down[i]} + at.row;
    // Inside the image, towards zero is down.
    const int middle = static_cast<int>(v + 0.5) * stride + static_cast<int>(u + 0.5);
    const std::uint32_t* here = sums + middle;
    const std::uint32_t left_column = here[below - half] - here[-below - half];
    const std::uint32_t middle_column = here[below] - here[-below];
    const std::uint32_t right_column = here[below + half] - here[-below + half];
    const auto all = static_cast<std::int32_t>(right_column - left_column);
    const auto left = static_cast<std::int32_t>(middle_column - left_column);
    const auto upper = static_cast<std::int32_t>(here[half] - here[-half] - here[-below + half] +
                                                 here[-below - half]);
    x[i] = static_cast<float>(all - 2 * left);
    y[i] = static_cast<float>(all - 2 * upper);
  }
}

/// Like std::atan2 + pi, to 1e-5 radians.
PLANAR_MAPPING_MULTIVERSION
void anglesOf(const float* x, const float* y, int count, float* __restrict angles) {
  constexpr float kPi = 3.14159265f;
  for (int i = 0; i < count; ++i) {
    const float across = std::fabs(x[i]);
    const float up = std::fabs(y[i]);
    const float longer = std::max(std::max(across, up), 1e-6f);
    const float t = std::min(across, up) / longer;
    const float s = t * t;
    const float low =
        t *
        (0.9998660f + s * (-0.3302995f + s * (0.1801410f + s * (-0.0851330f + s * 0.0208351f))));
    const float quarter = up > across ? kPi / 2.0f - low : low;
    const float upper = x[i] < 0.0f ? kPi - quarter : quarter;
    angles[i] = (y[i] < 0.0f ? -upper : upper) + kPi;
  }
}

constexpr int kRadius = 6;      // scales
constexpr int kInCircle = 109;  // samples nearer than that

/// Samples in the circle, and their weights by a Gaussian.
struct Circle {
  std::array<float, kInCircle> across, down, weight;

  Circle() {
    constexpr double kSigma = 2.5;
    std::size_t n = 0;
    for (int r = -kRadius; r <= kRadius; ++r) {
      for (int c = -kRadius; c <= kRadius; ++c) {
        if (r * r + c * c >= kRadius * kRadius) continue;
        across[n] = static_cast<float>(c);
        down[n] = static_cast<float>(r);
        weight[n++] = static_cast<float>(std::exp(-(r * r + c * c) / (2.0 * kSigma * kSigma)));
      }
    }
  }
};

/// Direction of the strongest gradient around a point, radians: the sector of 60 degrees, in steps
/// of 8, in which they add up to most.
double dominantAngle(const std::uint32_t* sums, int stride, const BlobPoint& point, int scale) {
  constexpr int kParts = 90;
  constexpr int kSectorStep = 2;  // parts between sectors
  constexpr int kWidth = 15;      // parts of a sector
  static const Circle circle;
  std::array<float, kInCircle> x, y, angles;
  const double step = scale;
  haarWavelets(sums, stride, {point.column, point.row, step, 0.0, 2 * scale}, circle.across.data(),
               circle.down.data(), kInCircle, x.data(), y.data());
  for (std::size_t i = 0; i < kInCircle; ++i) {
    x[i] *= circle.weight[i];
    y[i] *= circle.weight[i];
  }
  anglesOf(x.data(), y.data(), kInCircle, angles.data());
  struct Gradient {
    double x = 0.0, y = 0.0;
  };
  std::array<Gradient, kParts> parts{};
  for (std::size_t i = 0; i < kInCircle; ++i) {
    const int part = static_cast<int>(angles[i] * static_cast<float>(kParts / (2.0 * M_PI)));
    Gradient& sum = parts[static_cast<std::size_t>(std::min(part, kParts - 1))];
    sum.x += double{x[i]};
    sum.y += double{y[i]};
  }
  Gradient sector;
  const auto add = [&](int part, double sign) {
    const Gradient& one = parts[static_cast<std::size_t>(part % kParts)];
    sector.x += sign * one.x;
    sector.y += sign * one.y;
  };
  for (int part = 0; part < kWidth; ++part) add(part, 1.0);
  double longest = 0.0;
  double angle = 0.0;
  for (int first = 0; first < kParts; first += kSectorStep) {
    const double length = sector.x * sector.x + sector.y * sector.y;
    if (length > longest) {
      longest = length;
      angle = std::atan2(sector.y, sector.x);
    }
    for (int k = 0; k < kSectorStep; ++k) {
      add(first + k, -1.0);
      add(first + kWidth + k, 1.0);
    }
  }
  return angle;
}

constexpr int kHalf = 10;   // samples of the square
constexpr int kSquare = 5;  // samples of one of 4 x 4 squares
constexpr int kWindow = 8;  // of them, their neighbours, and one that does not count
constexpr int kSide = 24;   // of the grid of samples: with a rim that is even
constexpr int kInSquare = 4 * kHalf * kHalf;

/// Samples of the square at [1, 20] of both sides of a grid, and weights about a square's middle.
struct Grid {
  std::array<float, kInSquare> across, down;
  std::array<std::array<float, kWindow>, kSquare + 2> weights{};

  Grid() {
    for (int i = 0; i < kInSquare; ++i) {
      across[static_cast<std::size_t>(i)] = static_cast<float>(i % (2 * kHalf) - kHalf);
      down[static_cast<std::size_t>(i)] = static_cast<float>(i / (2 * kHalf) - kHalf);
    }
    constexpr int kMiddle = kSquare / 2 + 1;
    for (int r = 0; r < kSquare + 2; ++r)
      for (int c = 0; c < kSquare + 2; ++c)
        weights[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] =
            1.0f / static_cast<float>(4 + std::abs(r - kMiddle) + std::abs(c - kMiddle));
  }
};

/// Sums of a window's values and of their sizes. \param x, y  its first value of both
PLANAR_MAPPING_MULTIVERSION
void sumWindow(const float* x, const float* y, const float* weights, float* __restrict sums) {
  float lanes[4][kWindow] = {};
  for (int row = 0; row < kSquare + 2; ++row) {
    for (int k = 0; k < kWindow; ++k) {
      const float weight = weights[row * kWindow + k];
      const float gx = weight * x[row * kSide + k];
      const float gy = weight * y[row * kSide + k];
      lanes[0][k] += gx;
      lanes[1][k] += gy;
      lanes[2][k] += std::fabs(gx);
      lanes[3][k] += std::fabs(gy);
    }
  }
  for (int i = 0; i < 4; ++i) {
    float sum = 0.0f;
    for (int k = 0; k < kWindow; ++k) sum += lanes[i][k];
    sums[i] = sum;
  }
}

}  // namespace

void SurfDescriptor::operator()(const BlobPoint& point,
                                std::array<float, kSurfLength>& descriptor) const {
  static const Grid grid;
  // Unsigned: sums of large images run over, their differences do not.
  const auto* sums = reinterpret_cast<const std::uint32_t*>(image_.before(0));
  const int stride = image_.width() + 1;
  const int scale = static_cast<int>(point.scale + 0.5);
  const double angle = dominantAngle(sums, stride, point, scale);
  const double turn_x = std::cos(angle);
  const double turn_y = std::sin(angle);
  const auto cosine = static_cast<float>(turn_x);
  const auto sine = static_cast<float>(turn_y);
  const Samples at{point.column, point.row, turn_x * point.scale, turn_y * point.scale, scale};
  std::array<float, kInSquare> x, y;
  haarWavelets(sums, stride, at, grid.across.data(), grid.down.data(), kInSquare, x.data(),
               y.data());
  std::array<float, kSide * kSide> gx{};
  std::array<float, kSide * kSide> gy{};
  for (std::size_t i = 0; i < kInSquare; ++i) {
    const std::size_t place = (i / (2 * kHalf) + 1) * kSide + i % (2 * kHalf) + 1;
    gx[place] = cosine * x[i] + sine * y[i];
    gy[place] = cosine * y[i] - sine * x[i];
  }
  float* out = descriptor.data();
  for (int row = 0; row < 2 * kHalf; row += kSquare) {
    for (int column = 0; column < 2 * kHalf; column += kSquare, out += 4) {
      const int first = row * kSide + column;
      sumWindow(gx.data() + first, gy.data() + first, grid.weights[0].data(), out);
    }
  }
  float square = 0.0f;
  for (const float value : descriptor) square += value * value;
  const float length = std::sqrt(square) + 1e-7f;
  for (float& value : descriptor) value /= length;
}

}  // namespace planar_mapping::detail
