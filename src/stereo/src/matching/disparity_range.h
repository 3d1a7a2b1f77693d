// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace planar_mapping::detail {

/// How the left camera would have exposed the right image: gray values v as gain * v + offset.
struct Exposure {
  double gain = 1.0;
  double offset = 0.0;
  double change = 0.0;  ///< of mean and spread of the gray values
};

/// Disparities of a pair as a coarse search on small images sees them, pixels of the large image.
struct CoarseDisparities {
  double low = 0.0;
  double high = 0.0;
  double density = 0.0;  ///< fraction with a disparity, of the pixels with contrast
  Exposure exposure;     ///< by the pixels with a disparity
};

/// \param left, right  gray, of one size
/// \param infinity  disparity of infinity: nothing less is looked for
/// \param largest   nothing more is looked for; > infinity
CoarseDisparities searchCoarsely(const cv::Mat& left, const cv::Mat& right, double infinity,
                                 double largest);

}  // namespace planar_mapping::detail
