// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace planar_mapping::detail {

/// Sums of gray values over rectangles. Sums of all pixels run over beyond 8 million; differences
/// of two are right modulo 2^32 all the same.
class IntegralImage {
 public:
  explicit IntegralImage(const cv::Mat& gray) { cv::integral(gray, sums_, CV_32S); }

  int width() const { return sums_.cols - 1; }
  int height() const { return sums_.rows - 1; }
  /// Sums over all rows before this one, by column.
  const std::int32_t* before(int row) const { return sums_.ptr<std::int32_t>(row); }

 private:
  cv::Mat sums_;
};

struct BlobPoint {
  double column = 0.0;  ///< pixels
  double row = 0.0;
  double scale = 0.0;  ///< 1.2 for the smallest filter, of 9 pixels
};

constexpr int kSurfLength = 64;

/// Describes points by sums of Haar wavelets and of their sizes in 4 x 4 squares of 5 x 5 samples
/// and their neighbours, in a frame that turns with the point; of length 1, 0 where the image is
/// even.
class SurfDescriptor {
 public:
  explicit SurfDescriptor(const IntegralImage& image) : image_(image) {}

  /// \pre the square of 32 scales about the point lies in the image
  void operator()(const BlobPoint& point, std::array<float, kSurfLength>& descriptor) const;

 private:
  const IntegralImage& image_;
};

}  // namespace planar_mapping::detail
