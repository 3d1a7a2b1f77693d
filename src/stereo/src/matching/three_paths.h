// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "matching/semi_global.h"

namespace planar_mapping::detail {

/// Semi-global matching along three paths (from the left, the right and above) on bytes, in half
/// the time of OpenCV's. Costs are differences of horizontal gradients, so that the exposure of
/// the two cameras may differ; half a pixel of sampling costs nothing (Birchfield and Tomasi, PAMI
/// 1998). The right image's disparities are searched for as well, and must agree.
/// \return disparities of the left image in units of 1 / 16 pixel; (min_disparity - 1) * 16 = none
cv::Mat matchAlongThreePaths(const cv::Mat& left, const cv::Mat& right,
                             const SemiGlobalParams& params);

}  // namespace planar_mapping::detail
