// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "features/integral_image.h"

namespace planar_mapping::detail {

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
