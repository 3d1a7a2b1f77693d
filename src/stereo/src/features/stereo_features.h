// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "features/feature_detection.h"

namespace planar_mapping::detail {

/// Where a match may lie: column of the left minus column of the right feature.
struct RowSearch {
  double low = 0.0;
  double high = 0.0;
  double epipolar_tolerance = 2.0;
  double ratio = 0.9;
};

/// For each left feature the right one on its row with the nearest descriptor, or -1.
std::vector<int> matchAlongRows(const DetectedFeatures& left, const DetectedFeatures& right,
                                const RowSearch& search);

/// Columns in the right image below the pixel, of left features at (column, row) with a match near
/// `right_column`; NaN where the gray values do not agree or are too flat.
struct RowPlace {
  float column = 0.0f;
  float row = 0.0f;
  float right_column = 0.0f;
};
std::vector<float> refineAlongRows(const cv::Mat& left, const cv::Mat& right,
                                   const std::vector<RowPlace>& places, int window,
                                   float max_residual, int threads);

}  // namespace planar_mapping::detail
