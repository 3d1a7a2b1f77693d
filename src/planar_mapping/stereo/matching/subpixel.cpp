// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/stereo/matching/subpixel.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "planar_mapping/base/parallel.h"
#include "planar_mapping/base/simd.h"

namespace planar_mapping::detail {
namespace {

constexpr int kSums = 7;                // of a window: g g, g r, g, r, 1, h h, h
constexpr int kRowsPerChunk = 120;      // of work; the rows of a window about them come twice
constexpr float kSimilar = 1.0f;        // disparities that differ more belong to other surfaces
constexpr float kLargestShift = 0.35f;  // what is found before is no farther off
constexpr float kMinContrast = 0.05f;   // likewise, of gradients: rounding of gray values
constexpr float kNoise = 16.0f;  // gray levels squared: where there is less contrast, trust less

/// Mean over the similar ones of 5 x 5, which lie in `rows`, at columns [2, width - 2).
PLANAR_MAPPING_MULTIVERSION
void smoothRow(const float* const* rows, int width, float* out) {
  const float* center = rows[2];
  for (int x = 2; x < width - 2; ++x) {
    const float own = center[x];
    float sum = 0.0f;
    float count = 0.0f;
    for (int dy = 0; dy < 5; ++dy) {
      const float* row = rows[dy] + x;
      for (int dx = -2; dx <= 2; ++dx) {
        const float difference = row[dx] - own;
        const bool similar = std::fabs(difference) <= kSimilar;  // not for NaN
        sum += similar ? difference : 0.0f;
        count += similar ? 1.0f : 0.0f;
      }
    }
    out[x] = own + sum / count;  // NaN stays NaN: 0 / 0
  }
}

/// Gradient g (mean of both images), half the difference h of the two, and residual r of each pixel
/// at its disparity, as the products that are summed.
PLANAR_MAPPING_MULTIVERSION
void residualRow(const float* left, const float* right, const float* disparity, int width,
                 float* out) {
  float* gg = out;
  float* gr = out + width;
  float* g1 = out + 2 * width;
  float* r1 = out + 3 * width;
  float* one = out + 4 * width;
  float* hh = out + 5 * width;
  float* h1 = out + 6 * width;
  for (int x = 1; x < width - 1; ++x) {
    const float position = static_cast<float>(x) - disparity[x];
    const bool inside = position >= 1.0f && position < static_cast<float>(width - 2);
    const float safe = inside ? position : 1.0f;
    const int base = static_cast<int>(safe);
    const float fraction = safe - static_cast<float>(base);
    const float a = right[base - 1];
    const float b = right[base];
    const float c = right[base + 1];
    const float d = right[std::min(base + 2, width - 1)];
    const float value = b + fraction * (c - b);
    // Both gradients: a Gauss-Newton step with their mean errs only in the third order.
    const float slope_right = 0.5f * ((c - a) + fraction * ((d - b) - (c - a)));
    const float slope_left = 0.5f * (left[x + 1] - left[x - 1]);
    const float slope = 0.5f * (slope_right + slope_left);
    const float weight = inside ? 1.0f : 0.0f;
    const float h = weight * 0.5f * (slope_right - slope_left);
    const float g = weight * slope;
    const float r = weight * (left[x] - value);
    gg[x] = g * g;
    gr[x] = g * r;
    g1[x] = g;
    r1[x] = r;
    one[x] = weight;
    hh[x] = h * h;
    h1[x] = h;
  }
}

/// Sums of `window` neighbours along the row.
PLANAR_MAPPING_MULTIVERSION
void sumAlong(const float* values, int width, int window, float* out) {
  const int half = window / 2;
  for (int x = half; x < width - half; ++x) {
    float sum = 0.0f;
    for (int k = -half; k <= half; ++k) sum += values[x + k];
    out[x] = sum;
  }
}

PLANAR_MAPPING_MULTIVERSION
void addRow(const float* values, int count, float* sums) {
  for (int i = 0; i < count; ++i) sums[i] += values[i];
}

PLANAR_MAPPING_MULTIVERSION
void agreementRow(const float* sums, int width, int half, float* agreement) {
  const float* gg = sums;
  const float* g1 = sums + 2 * width;
  const float* one = sums + 4 * width;
  const float* hh = sums + 5 * width;
  const float* h1 = sums + 6 * width;
  for (int x = half; x < width - half; ++x) {
    const float count = std::max(one[x], 1.0f);
    const float common = gg[x] - g1[x] * g1[x] / count;
    const float different = hh[x] - h1[x] * h1[x] / count;
    agreement[x] = (common - different) / (common + different + kMinContrast * count);
  }
  for (int x = 0; x < half; ++x) {
    agreement[x] = agreement[half];
    agreement[width - 1 - x] = agreement[width - 1 - half];
  }
}

PLANAR_MAPPING_MULTIVERSION
void shiftRow(const float* sums, int width, int half, float* disparity) {
  const float* gg = sums;
  const float* gr = sums + width;
  const float* g1 = sums + 2 * width;
  const float* r1 = sums + 3 * width;
  const float* one = sums + 4 * width;
  for (int x = half; x < width - half; ++x) {
    const float count = std::max(one[x], 1.0f);
    const float slope = gg[x] - g1[x] * g1[x] / count;
    const float fit = gr[x] - g1[x] * r1[x] / count;
    const float shift = -fit / (slope + kNoise * count);
    disparity[x] += std::min(std::max(shift, -kLargestShift), kLargestShift);
  }
}

/// Work on some rows at a time, each with the rows its window needs.
class Refinement {
 public:
  Refinement(const std::uint8_t* left, const std::uint8_t* right, int width, int height, int window,
             int threads)
      : width_(width),
        height_(height),
        window_(window),
        threads_(threads),
        left_(left, left + pixels()),
        right_(right, right + pixels()) {}

  void run(bool refine, float* disparity, float* agreement) {
    std::vector<float> smooth(disparity, disparity + pixels());
    if (refine) {
      forRows([&](int first, int last) { smoothRows(disparity, first, last, smooth.data()); });
      std::copy(smooth.begin(), smooth.end(), disparity);
    }
    forRows([&](int first, int last) {
      shiftRows(smooth.data(), first, last, refine ? disparity : nullptr, agreement);
    });
    const int half = window_ / 2;
    for (int row = 0; row < half; ++row) {
      std::copy_n(agreement + rowStart(half), width_, agreement + rowStart(row));
      std::copy_n(agreement + rowStart(height_ - 1 - half), width_,
                  agreement + rowStart(height_ - 1 - row));
    }
  }

 private:
  std::size_t pixels() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  }
  std::size_t rowStart(int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
  }
  template <typename Body>
  void forRows(const Body& body) const {
    const auto chunks = static_cast<std::size_t>((height_ + kRowsPerChunk - 1) / kRowsPerChunk);
    parallelFor(chunks, threads_, [&](std::size_t chunk) {
      const int first = static_cast<int>(chunk) * kRowsPerChunk;
      body(first, std::min(first + kRowsPerChunk, height_));
    });
  }
  void smoothRows(const float* disparity, int first, int last, float* out) const {
    for (int row = std::max(first, 2); row < std::min(last, height_ - 2); ++row) {
      const float* rows[5];
      for (int k = 0; k < 5; ++k) rows[k] = disparity + rowStart(row + k - 2);
      smoothRow(rows, width_, out + rowStart(row));
    }
  }
  void shiftRows(const float* disparity, int first, int last, float* out, float* agreement) const {
    const int half = window_ / 2;
    const std::size_t stride = rowStart(kSums);
    // The summed rows of a window stay in a ring.
    std::vector<float> products(stride, 0.0f);
    std::vector<float> ring(stride * static_cast<std::size_t>(window_), 0.0f);
    std::vector<float> sums(stride);
    const int begin = std::max(first, half);
    const int end = std::min(last, height_ - half);
    for (int row = begin - half; row < end + half; ++row) {
      residualRow(left_.data() + rowStart(row), right_.data() + rowStart(row),
                  disparity + rowStart(row), width_, products.data());
      float* summed = ring.data() + stride * static_cast<std::size_t>(row % window_);
      for (int k = 0; k < kSums; ++k)
        sumAlong(products.data() + rowStart(k), width_, window_, summed + rowStart(k));
      const int center = row - half;
      if (center < begin) continue;
      std::fill(sums.begin(), sums.end(), 0.0f);
      for (int k = 0; k < window_; ++k)
        addRow(ring.data() + stride * static_cast<std::size_t>(k), static_cast<int>(stride),
               sums.data());
      if (out != nullptr) shiftRow(sums.data(), width_, half, out + rowStart(center));
      agreementRow(sums.data(), width_, half, agreement + rowStart(center));
    }
  }

  int width_;
  int height_;
  int window_;
  int threads_;
  std::vector<float> left_;
  std::vector<float> right_;
};

}  // namespace

void refineDisparity(const std::uint8_t* left, const std::uint8_t* right, int width, int height,
                     int window, bool refine, int threads, float* disparity, float* agreement) {
  if (width < 2 * window || height < 2 * window) {
    std::fill_n(agreement, static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                1.0f);
    return;
  }
  Refinement(left, right, width, height, window, threads).run(refine, disparity, agreement);
}

}  // namespace planar_mapping::detail
